//! JSON text in which single values are replaced and everything else stays as it was written, byte for byte.

use std::ops::Range;

use gltf::json::Value;

/// A text that was parsed before, so that it is known to be JSON.
#[derive(Clone, Debug)]
pub struct JsonText {
    text: String,
}

/// Where a path leads.
enum Place {
    /// To a value.
    Value(Range<usize>),
    /// Into an object or list that ends there (its bracket), but lacks what the path names from this step on.
    Missing { end: usize, is_empty: bool, step: usize },
}

impl JsonText {
    /// This text, which is one value in JSON.
    pub fn new(text: String) -> Self {
        Self { text }
    }

    /// As it is now.
    pub fn into_text(self) -> String {
        self.text
    }

    /// The value that a path of names and indices leads to, as it is written; `None` where there is none.
    pub fn get(&self, path: &str) -> Option<&str> {
        match self.find(&steps(path))? {
            Place::Value(range) => Some(&self.text[range]),
            Place::Missing { .. } => None,
        }
    }

    /// Sets a value; objects on the way to it are made where they are missing. False where the path cannot be: a number is
    /// no object, and a list has no names.
    pub fn set(&mut self, path: &str, value: &Value) -> bool {
        self.put(path, value.to_string())
    }

    /// Sets a value that is written already.
    pub fn put(&mut self, path: &str, written: String) -> bool {
        let steps = steps(path);
        match self.find(&steps) {
            None => false,
            Some(Place::Value(range)) => {
                self.text.replace_range(range, &written);
                true
            }
            Some(Place::Missing { end, is_empty, step }) => {
                let inner = steps[step + 1..]
                    .iter()
                    .rev()
                    .fold(written, |inner, name| format!("{{{}:{inner}}}", quoted(name)));
                let comma = if is_empty { "" } else { "," };
                let is_list = self.text.as_bytes().get(end) == Some(&b']');
                let member = if is_list {
                    format!("{comma}{inner}")
                } else {
                    format!("{comma}{}:{inner}", quoted(steps[step]))
                };
                self.text.insert_str(end, &member);
                true
            }
        }
    }

    /// Takes a member out of an object, with what is written between it and the next one.
    pub fn remove(&mut self, path: &str) {
        let steps = steps(path);
        let Some((name, owner)) = steps.split_last() else {
            return;
        };
        let Some(Place::Value(object)) = self.find(owner) else {
            return;
        };
        let bytes = self.text.as_bytes();
        let mut members = Members::new(&self.text, object.start);
        let mut before = None;
        while let Some((key, value)) = members.next() {
            if decoded(&self.text[key.clone()]) == **name {
                let after = skip_space(bytes, value.end);
                let cut = match before {
                    _ if bytes.get(after) == Some(&b',') => key.start..skip_space(bytes, after + 1),
                    Some(before) => before..value.end,
                    None => key.start..value.end,
                };
                self.text.replace_range(cut, "");
                return;
            }
            before = Some(value.end);
        }
    }

    fn find(&self, steps: &[&str]) -> Option<Place> {
        let bytes = self.text.as_bytes();
        let mut at = skip_space(bytes, 0);
        for (step, name) in steps.iter().enumerate() {
            let is_list = match bytes.get(at)? {
                b'{' => false,
                b'[' => true,
                _ => return None,
            };
            let mut members = Members::new(&self.text, at);
            let (mut found, mut index, mut last) = (None, 0, at + 1);
            while let Some((key, value)) = members.next() {
                let is_it = if is_list {
                    name.parse() == Ok(index)
                } else {
                    decoded(&self.text[key]) == **name
                };
                if is_it {
                    // Of members of one name the last one counts, as for who reads the text.
                    found = Some(value.start);
                }
                (index, last) = (index + 1, value.end);
            }
            match found {
                Some(start) => at = start,
                None if is_list && name.parse() != Ok(index) => return None,
                None => {
                    let end = skip_space(bytes, last);
                    let is_empty = index == 0;
                    return Some(Place::Missing { end, is_empty, step });
                }
            }
        }
        Some(Place::Value(at..value_end(bytes, at)))
    }
}

/// The members of an object or list: where each name (empty in a list) and each value stands.
struct Members<'a> {
    text: &'a str,
    at: usize,
    is_list: bool,
}

impl<'a> Members<'a> {
    fn new(text: &'a str, start: usize) -> Self {
        Self {
            text,
            at: start + 1,
            is_list: text.as_bytes().get(start) == Some(&b'['),
        }
    }

    fn next(&mut self) -> Option<(Range<usize>, Range<usize>)> {
        let bytes = self.text.as_bytes();
        self.at = skip_space(bytes, self.at);
        if bytes.get(self.at) == Some(&b',') {
            self.at = skip_space(bytes, self.at + 1);
        }
        if matches!(bytes.get(self.at), None | Some(b'}' | b']')) {
            return None;
        }
        let mut key = self.at..self.at;
        if !self.is_list {
            key = self.at..value_end(bytes, self.at);
            // Past the colon.
            self.at = skip_space(bytes, skip_space(bytes, key.end) + 1);
        }
        let value = self.at..value_end(bytes, self.at);
        self.at = value.end;
        Some((key, value))
    }
}

fn steps(path: &str) -> Vec<&str> {
    path.split('/').filter(|step| !step.is_empty()).collect()
}

fn quoted(name: &str) -> String {
    Value::from(name).to_string()
}

/// A name as it is meant.
fn decoded(written: &str) -> String {
    serde_json::from_str(written).unwrap_or_default()
}

fn skip_space(bytes: &[u8], mut at: usize) -> usize {
    while bytes.get(at).is_some_and(u8::is_ascii_whitespace) {
        at += 1;
    }
    at
}

/// Where the value that begins there ends.
fn value_end(bytes: &[u8], start: usize) -> usize {
    match bytes.get(start) {
        Some(b'"') => text_end(bytes, start),
        Some(b'{' | b'[') => brackets_end(bytes, start),
        _ => {
            let is_over = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b'}' | b']' | b':');
            let length = bytes[start.min(bytes.len())..].iter().position(is_over);
            length.map_or(bytes.len(), |length| start + length)
        }
    }
}

fn text_end(bytes: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'\\' => at += 2,
            b'"' => return at + 1,
            _ => at += 1,
        }
    }
    bytes.len()
}

fn brackets_end(bytes: &[u8], start: usize) -> usize {
    let (mut at, mut depth) = (start, 0_usize);
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'"' => {
                at = text_end(bytes, at);
                continue;
            }
            b'{' | b'[' => depth += 1,
            b'}' | b']' if depth == 1 => return at + 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const TEXT: &str =
        "{ \"a\\u0062\" : [1.50, {\"x\": \"}]\\\"\"} ],\n \"n\": {},\t\"l\":[ ] , \"n2\":{\"k\":1e-0 } }";

    fn changed(change: impl FnOnce(&mut JsonText)) -> String {
        let mut text = JsonText::new(TEXT.into());
        change(&mut text);
        let text = text.into_text();
        assert!(serde_json::from_str::<Value>(&text).is_ok(), "{text}");
        text
    }

    #[test]
    fn a_value_is_replaced_where_it_stands() {
        let text = changed(|text| assert!(text.set("/ab/1/x", &json!(7))));
        assert_eq!(text, TEXT.replace("\"}]\\\"\"", "7"));
        let text = changed(|text| assert!(text.set("/ab/0", &json!([1.5]))));
        assert_eq!(text, TEXT.replace("1.50", "[1.5]"));
    }

    #[test]
    fn what_is_missing_is_added_at_the_end() {
        let text = changed(|text| assert!(text.set("/n/p/q", &json!(true))));
        assert_eq!(text, TEXT.replace("\"n\": {}", "\"n\": {\"p\":{\"q\":true}}"));
        let text = changed(|text| assert!(text.set("/n2/m", &json!(2))));
        assert_eq!(text, TEXT.replace("1e-0 }", "1e-0 ,\"m\":2}"));
        let text = changed(|text| {
            assert!(text.set("/l/0", &json!("a")) && text.set("/l/1", &json!("b")));
            assert!(!text.set("/l/5", &json!("c")), "a list has no gaps");
            assert!(!text.set("/ab/0/x", &json!("c")), "a number has no members");
        });
        assert_eq!(text, TEXT.replace("[ ]", "[ \"a\",\"b\"]"));
    }

    #[test]
    fn members_are_taken_out_wherever_they_stand() {
        for (path, left) in [
            ("/n2", vec!["ab", "n", "l"]),
            ("/ab", vec!["n", "l", "n2"]),
            ("/l", vec!["ab", "n", "n2"]),
            ("/none", vec!["ab", "n", "l", "n2"]),
        ] {
            let text = changed(|text| text.remove(path));
            let value: Value = serde_json::from_str(&text).expect("it is JSON");
            let names: Vec<_> = value.as_object().expect("an object").keys().collect();
            assert_eq!(names, left);
        }
        assert_eq!(
            changed(|text| text.remove("/n2/k")),
            TEXT.replace("\"k\":1e-0 ", " ")
        );
    }

    #[test]
    fn values_are_found_as_they_are_written() {
        let text = JsonText::new(TEXT.into());
        assert_eq!(text.get("/ab/0"), Some("1.50"));
        assert_eq!(text.get("/n2"), Some("{\"k\":1e-0 }"));
        assert_eq!(text.get("/n2/none"), None);
    }
}
