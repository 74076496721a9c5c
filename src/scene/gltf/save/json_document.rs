//! A JSON document in which single values are changed; all other members, and their order, stay.

use gltf::json::Value;
use serde_json::json;

use crate::error::{Error, Result};

/// A document that was parsed before.
#[derive(Clone, Debug)]
pub struct JsonDocument {
    root: Value,
    /// As it was read, until something changes.
    unchanged: Option<String>,
}

impl JsonDocument {
    /// Parses a text.
    ///
    /// # Errors
    /// Something else than JSON in UTF-8.
    pub fn parse(json: &[u8]) -> Result<Self> {
        let refused = |what: String| Error::failure("JSON", what, "export the file again");
        let text = std::str::from_utf8(json).map_err(|_| refused("is not UTF-8".into()))?;
        let text = text.trim_end_matches([' ', '\0']);
        Ok(Self {
            root: serde_json::from_str(text).map_err(|error| refused(format!("is damaged ({error})")))?,
            unchanged: Some(text.to_owned()),
        })
    }

    /// As it is now.
    pub fn into_text(self) -> String {
        self.unchanged.unwrap_or_else(|| self.root.to_string())
    }

    /// The value that a path of names and indices leads to; `None` where there is none.
    pub fn get(&self, path: &str) -> Option<&Value> {
        self.root.pointer(path)
    }

    /// Sets a value; objects on the way to it are made where they are missing, and a list takes one more item at its end.
    /// Nothing happens where the path cannot be: a number is no object, and a list has no names.
    pub fn set(&mut self, path: &str, value: Value) {
        let mut place = &mut self.root;
        for name in path.split('/').skip(1) {
            place = match place {
                Value::Object(members) => members.entry(name).or_insert_with(|| json!({})),
                Value::Array(items) => {
                    let Some(index) = name.parse::<usize>().ok().filter(|index| *index <= items.len()) else {
                        return;
                    };
                    if index == items.len() {
                        items.push(json!({}));
                    }
                    &mut items[index]
                }
                _ => return,
            };
        }
        *place = value;
        self.unchanged = None;
    }

    /// Adds an item to a list, which is made where it is missing; gives its index.
    pub fn append(&mut self, list: &str, item: Value) -> usize {
        let count = self.get(list).and_then(Value::as_array).map_or(0, Vec::len);
        match count {
            0 => self.set(list, json!([item])),
            _ => self.set(&format!("{list}/{count}"), item),
        }
        count
    }

    /// Takes a member out of an object.
    pub fn remove(&mut self, path: &str) {
        let Some((owner, name)) = path.rsplit_once('/') else {
            return;
        };
        let owner = self.root.pointer_mut(owner).and_then(Value::as_object_mut);
        if owner.and_then(|owner| owner.shift_remove(name)).is_some() {
            self.unchanged = None;
        }
    }

    /// Names an extension among those that the file uses.
    pub fn use_extension(&mut self, name: &str) {
        const USED: &str = "/extensionsUsed";
        let used = self.get(USED).and_then(Value::as_array);
        if !used.is_some_and(|used| used.iter().any(|used| used == name)) {
            self.append(USED, json!(name));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"ab":[1.5,{"x":"}]"}],"n":{},"l":[],"n2":{"k":1.0}}"#;

    fn changed(change: impl FnOnce(&mut JsonDocument)) -> String {
        let mut document = JsonDocument::parse(TEXT.as_bytes()).expect("it is JSON");
        change(&mut document);
        document.into_text()
    }

    #[test]
    fn values_are_replaced_in_place_and_missing_ones_added_last() {
        for (path, before, after) in [
            ("/ab/1/x", r#""}]""#, "7"),
            ("/n/p/q", "{}", r#"{"p":{"q":7}}"#),
            ("/n2/m", "1.0}", r#"1.0,"m":7}"#),
            ("/l/0", "[]", "[7]"),
            ("/l/5", "", ""),
            ("/ab/0/x", "", ""),
        ] {
            let text = changed(|document| document.set(path, json!(7)));
            assert_eq!(text, TEXT.replace(before, after), "{path}");
        }
    }

    #[test]
    fn members_are_removed_and_the_others_keep_their_order() {
        for (path, before) in [("/n", r#""n":{},"#), ("/n2/k", r#""k":1.0"#), ("/none", "")] {
            let text = changed(|document| document.remove(path));
            assert_eq!(text, TEXT.replace(before, ""), "{path}");
        }
    }

    #[test]
    fn without_a_change_the_text_stays_as_it_was_written() {
        let text = "{ \"a\" : 1e-0,\n \"b\":[ ] }";
        let document = JsonDocument::parse(text.as_bytes()).expect("it is JSON");
        assert_eq!(document.into_text(), text);
    }
}
