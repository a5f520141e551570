//! Mutations of JSON documents.

use serde_json::{Map, Value, json};

use super::Mutator;

/// Words that readers look for or should not trust.
const WORDS: [&str; 24] = [
    "",
    "../body.glb",
    "/etc/hosts",
    "C:\\a",
    "a\0b",
    "data:,x",
    "Hips",
    "LeftFoot",
    "mixamorig:Hips",
    "\u{202e}x",
    "CUBICSPLINE",
    "STEP",
    "rotation",
    "translation",
    "scale",
    "weights",
    "VEC4",
    "VEC3",
    "SCALAR",
    "MAT4",
    "inertial",
    "inertial-materials",
    "pose-window",
    "F64",
];

impl Mutator<'_> {
    /// Changes one place of a document.
    pub(super) fn json(&mut self, document: &mut Value) {
        let place = self.below(count(document));
        let donor = self.below(count(document));
        let donor = nth(document, donor).clone();
        if let Some(value) = nth_mut(document, &mut { place }) {
            self.change(value, donor);
        }
    }

    fn change(&mut self, value: &mut Value, donor: Value) {
        if self.one_in(12) {
            *value = donor;
            return;
        }
        match value {
            Value::Array(list) => self.change_list(list),
            Value::Object(fields) => self.change_fields(fields, donor),
            Value::Number(number) => *value = self.changed_number(number),
            Value::String(word) => *value = self.changed_word(word),
            Value::Bool(is) => *is = !*is,
            Value::Null => *value = json!(self.integer()),
        }
    }

    fn changed_number(&mut self, number: &serde_json::Number) -> Value {
        if let Some(integer) = number.as_i64()
            && !self.one_in(3)
        {
            let step = [-1, 1, 4, -4, 8][self.below(5)];
            return json!(integer.wrapping_add(step));
        }
        match self.below(3) {
            0 => json!(self.integer()),
            // JSON has no number that is not finite.
            1 => json!(self.float()),
            _ => json!(number.as_f64().unwrap_or(0.0) * [-1.0, 0.5, 1000.0, 1e30][self.below(4)]),
        }
    }

    fn changed_word(&mut self, word: &str) -> Value {
        match self.below(4) {
            0 => json!(word.repeat(2)),
            1 => {
                let mut bytes = word.as_bytes().to_vec();
                (self.raw)(&mut bytes);
                json!(String::from_utf8_lossy(&bytes))
            }
            _ => json!(WORDS[self.below(WORDS.len())]),
        }
    }

    fn change_list(&mut self, list: &mut Vec<Value>) {
        if list.is_empty() {
            return list.push(json!(self.integer()));
        }
        let (at, other) = (self.below(list.len()), self.below(list.len()));
        match self.below(4) {
            0 => {
                list.remove(at);
            }
            1 => list.insert(other, list[at].clone()),
            2 => list.truncate(at),
            _ => list.swap(at, other),
        }
    }

    fn change_fields(&mut self, fields: &mut Map<String, Value>, donor: Value) {
        let names: Vec<String> = fields.keys().cloned().collect();
        if names.is_empty() {
            return;
        }
        let (at, other) = (self.below(names.len()), self.below(names.len()));
        match self.below(3) {
            0 => {
                fields.remove(&names[at]);
            }
            1 => {
                let value = fields[&names[other]].clone();
                fields.insert(names[at].clone(), value);
            }
            _ => {
                fields.insert(names[at].clone(), donor);
            }
        }
    }
}

fn children(value: &Value) -> Box<dyn Iterator<Item = &Value> + '_> {
    match value {
        Value::Array(list) => Box::new(list.iter()),
        Value::Object(fields) => Box::new(fields.values()),
        _ => Box::new(std::iter::empty()),
    }
}

/// How many values a document has, itself among them.
fn count(value: &Value) -> usize {
    1 + children(value).map(count).sum::<usize>()
}

/// The value at that place, counted from the root.
fn nth(value: &Value, place: usize) -> &Value {
    let mut left = place;
    if left == 0 {
        return value;
    }
    left -= 1;
    for child in children(value) {
        let size = count(child);
        if left < size {
            return nth(child, left);
        }
        left -= size;
    }
    value
}

/// As [`nth`], to be changed; counts `left` down to 0.
fn nth_mut<'v>(value: &'v mut Value, left: &mut usize) -> Option<&'v mut Value> {
    if *left == 0 {
        return Some(value);
    }
    *left -= 1;
    match value {
        Value::Array(list) => list.iter_mut().find_map(|child| nth_mut(child, left)),
        Value::Object(fields) => fields.values_mut().find_map(|child| nth_mut(child, left)),
        _ => None,
    }
}
