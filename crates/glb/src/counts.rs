//! How many things a document lists, counted before any of them is made.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::GlbError;

/// Most things in a list of the document. An empty node takes two letters of a file and hundreds of
/// bytes of memory.
const MAX_LISTED: usize = 65_536;

/// The lists of a document whose things may be written as `{}`. A counted thing takes no memory.
#[derive(Deserialize)]
#[serde(default)]
#[derive(Default)]
struct Lists {
    nodes: Vec<IgnoredAny>,
    materials: Vec<IgnoredAny>,
    images: Vec<IgnoredAny>,
    samplers: Vec<IgnoredAny>,
    textures: Vec<IgnoredAny>,
    scenes: Vec<IgnoredAny>,
    meshes: Vec<IgnoredAny>,
    skins: Vec<IgnoredAny>,
    cameras: Vec<IgnoredAny>,
    animations: Vec<IgnoredAny>,
    accessors: Vec<IgnoredAny>,
    #[serde(rename = "bufferViews")]
    buffer_views: Vec<IgnoredAny>,
    buffers: Vec<IgnoredAny>,
}

/// Refuses documents that list more than any file of a character does.
///
/// # Errors
/// [`GlbError`] where the document is no JSON, or lists too much.
pub fn check(json: &[u8]) -> Result<(), GlbError> {
    let lists: Lists = serde_json::from_slice(json)
        .map_err(|error| GlbError::new("JSON chunk", format!("a glTF 2.0 document ({error})")))?;
    let counts = [
        ("nodes", lists.nodes.len()),
        ("materials", lists.materials.len()),
        ("images", lists.images.len()),
        ("samplers", lists.samplers.len()),
        ("textures", lists.textures.len()),
        ("scenes", lists.scenes.len()),
        ("meshes", lists.meshes.len()),
        ("skins", lists.skins.len()),
        ("cameras", lists.cameras.len()),
        ("animations", lists.animations.len()),
        ("accessors", lists.accessors.len()),
        ("bufferViews", lists.buffer_views.len()),
        ("buffers", lists.buffers.len()),
    ];
    match counts.iter().find(|(_, count)| *count > MAX_LISTED) {
        None => Ok(()),
        Some((list, count)) => {
            let expected = format!("at most {MAX_LISTED}, got {count}");
            Err(GlbError::new(*list, expected))
        }
    }
}
