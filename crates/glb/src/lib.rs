//! Untrusted binary glTF 2.0 files: the container, the document, and accessors whose every index
//! and length is checked before a byte is read.
//!
//! The `gltf` crate parses the container and the JSON; its own accessor readers trust offsets and
//! strides, which wrap around or panic in malicious files.

mod counts;
mod humanoid;
#[cfg(feature = "meshopt")]
mod meshopt;
mod nodes;
mod values;

use std::borrow::Cow;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

pub use humanoid::humanoid_bones;
pub use nodes::{Local, MAX_NODES, local_transform, node_parents, part_names};
pub use values::MAX_ELEMENTS;

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: expected {expected}")]
pub struct GlbError {
    /// Part of the file.
    pub place: String,
    /// What would be right there.
    pub expected: String,
}

impl GlbError {
    /// A part of a file that is not what it should be.
    pub fn new(place: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            expected: expected.into(),
        }
    }
}

/// A binary glTF file.
#[derive(Clone, Debug)]
pub struct Document<'a> {
    /// The glTF document. Its indices are not checked.
    pub root: gltf::json::Root,
    json: Cow<'a, [u8]>,
    binary: Cow<'a, [u8]>,
    /// Compressed buffer views, by index.
    #[cfg(feature = "meshopt")]
    compressions: std::collections::BTreeMap<usize, meshopt::Compression>,
}

impl<'a> Document<'a> {
    /// Reads container and document.
    ///
    /// # Errors
    /// [`GlbError`] for what is no binary glTF 2.0 file or has no BIN chunk.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, GlbError> {
        check_length(bytes)?;
        let glb = gltf::binary::Glb::from_slice(bytes).map_err(|error| {
            GlbError::new("container", format!("a binary glTF 2.0 file ({error})"))
        })?;
        counts::check(&glb.json)?;
        let root = gltf::json::Root::from_slice(&glb.json).map_err(|error| {
            GlbError::new("JSON chunk", format!("a glTF 2.0 document ({error})"))
        })?;
        let binary = glb
            .bin
            .ok_or_else(|| GlbError::new("BIN chunk", "a binary buffer"))?;
        Ok(Self {
            root,
            #[cfg(feature = "meshopt")]
            compressions: meshopt::compressions(&glb.json),
            json: glb.json,
            binary,
        })
    }

    /// The text of the document, for extensions that [`Self::root`] does not know.
    pub fn json(&self) -> &[u8] {
        &self.json
    }

    /// Length of the binary buffer in bytes.
    pub fn binary_len(&self) -> usize {
        self.binary.len()
    }

    /// The component type of accessor `index`.
    ///
    /// # Errors
    /// [`GlbError`] where there is no such accessor or it has no known type.
    pub fn component_type(&self, index: usize) -> Result<ComponentType, GlbError> {
        match &self.accessor(index)?.component_type {
            Checked::Valid(found) => Ok(found.0),
            Checked::Invalid => Err(GlbError::new(
                format!("accessor {index}"),
                "a known component type",
            )),
        }
    }

    fn accessor(&self, index: usize) -> Result<&gltf::json::Accessor, GlbError> {
        self.root
            .accessors
            .get(index)
            .ok_or_else(|| GlbError::new(format!("accessor {index}"), "an accessor"))
    }

    /// The elements of accessor `index`, which has this type and lies in the file's own buffer.
    ///
    /// # Errors
    /// [`GlbError`] where it has another type, is sparse or lies elsewhere.
    pub fn elements(
        &self,
        index: usize,
        component: ComponentType,
        kind: Type,
    ) -> Result<Elements<'_>, GlbError> {
        let bad = |expected: &str| GlbError::new(format!("accessor {index}"), expected);
        let accessor = self.accessor(index)?;
        if self.component_type(index)? != component || accessor.type_ != Checked::Valid(kind) {
            return Err(bad(&format!("{kind:?} of {component:?}")));
        }
        if accessor.sparse.is_some() {
            return Err(bad("no sparse storage"));
        }
        let view = accessor
            .buffer_view
            .and_then(|view| self.root.buffer_views.get(view.value()))
            .ok_or_else(|| bad("a buffer view"))?;
        if view.buffer.value() != 0 {
            return Err(bad(
                "data in the file's own buffer, neither compressed nor in a file beside it",
            ));
        }
        let size = component.size() * kind.multiplicity();
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let view_start = view.byte_offset.map_or(0, |offset| offset.0);
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let range = || -> Option<&[u8]> {
            let view_start = usize::try_from(view_start).ok()?;
            let view_end = view_start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
            let view = self.binary.get(view_start..view_end)?;
            let needed = match count {
                0 => 0,
                _ => (count - 1).checked_mul(stride)?.checked_add(size)?,
            };
            let bytes = view.get(usize::try_from(offset).ok()?..)?;
            (stride >= size && bytes.len() >= needed).then_some(bytes)
        };
        let bytes = range().ok_or_else(|| bad("data inside the BIN chunk"))?;
        Ok(Elements {
            bytes,
            stride,
            size,
            count,
        })
    }
}

/// The `gltf` crate subtracts the header's size from the length written there unchecked.
fn check_length(bytes: &[u8]) -> Result<(), GlbError> {
    let written = match bytes.get(8..12) {
        Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as usize,
        _ => 0,
    };
    if written > bytes.len() {
        return Err(GlbError::new(
            "container",
            format!(
                "{written} bytes, as its header says; there are {}, so the file is cut off: copy or download it again",
                bytes.len()
            ),
        ));
    }
    if written < 12 {
        return Err(GlbError::new(
            "container",
            format!(
                "a header that gives the file's length, {} bytes",
                bytes.len()
            ),
        ));
    }
    Ok(())
}

/// The bytes of one accessor's elements.
#[derive(Clone, Copy, Debug)]
pub struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    /// Number of elements.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The bytes of each element.
    pub fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |idx| &bytes[idx * stride..idx * stride + size])
    }

    /// These elements, if there are `count` of them.
    ///
    /// # Errors
    /// [`GlbError`] about `what` where there are not.
    pub fn exactly(self, count: usize, what: &str) -> Result<Self, GlbError> {
        if self.count == count {
            Ok(self)
        } else {
            let expected = format!("{count} elements, got {}", self.count);
            Err(GlbError::new(what, expected))
        }
    }
}

/// Component `idx` of an element of 32-bit floats.
pub fn f32_at(element: &[u8], idx: usize) -> f32 {
    let at = idx * 4;
    f32::from_le_bytes([
        element[at],
        element[at + 1],
        element[at + 2],
        element[at + 3],
    ])
}

/// Component `idx` of an element of 16-bit integers.
pub fn i16_at(element: &[u8], idx: usize) -> i16 {
    i16::from_le_bytes([element[idx * 2], element[idx * 2 + 1]])
}
