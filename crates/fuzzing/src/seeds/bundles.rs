//! `bundle.json` in both versions.

use serde_json::{Value, json};

use crate::stage;

/// Version 2 with everything, version 2 as it is made, version 1.
pub fn json() -> Vec<Vec<u8>> {
    let bundle = stage::bundle();
    let text = bundle.to_json().expect("the made-up bundle can be written");
    let plain: Value = serde_json::from_str(&text).unwrap_or_default();
    let mut full = plain.clone();
    full["learned"] = json!({
        "stiffness": [1.0, 1.0], "damping": [1.0, 1.0], "shape": vec![[-2.0, 2.0]; 10]
    });
    full["training"] = json!({ "clips": 12, "hours": 0.5, "names": ["hop", "run"] });
    full["measured"] = json!({ "error_mm": 1.5 });
    let mut first = plain.clone();
    first["version"] = json!(1);
    if let Some(fields) = first.as_object_mut() {
        fields.remove("learned");
    }
    let files = [full, plain, first].map(|value| value.to_string().into_bytes());
    files.to_vec()
}
