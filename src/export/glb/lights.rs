//! The scene's own lights, taken out of a document.

use serde_json::Value;

const LISTS: [&str; 2] = ["KHR_lights_punctual", "EXT_lights_area"];

/// Removes every light that stands at a node, and their lists. What glows stays: it is seen.
pub fn remove(document: &mut Value) {
    for node in document["nodes"].as_array_mut().into_iter().flatten() {
        remove_extensions(node);
    }
    remove_extensions(document);
    for list in ["extensionsUsed", "extensionsRequired"] {
        if let Some(names) = document[list].as_array_mut() {
            names.retain(|name| !LISTS.iter().any(|list| name == list));
        }
        if document[list].as_array().is_none_or(Vec::is_empty)
            && let Some(fields) = document.as_object_mut()
        {
            fields.remove(list);
        }
    }
}

fn remove_extensions(owner: &mut Value) {
    let Some(fields) = owner.as_object_mut() else {
        return;
    };
    if let Some(extensions) = fields.get_mut("extensions").and_then(Value::as_object_mut) {
        for list in LISTS {
            extensions.remove(list);
        }
        if extensions.is_empty() {
            fields.remove("extensions");
        }
    }
}
