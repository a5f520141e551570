//! Vertex data of any storage that glTF allows, as floats and integers: any component type, normalised,
//! strided, sparse, and compressed by meshoptimizer where the feature `meshopt` is on.

use std::borrow::Cow;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use crate::{Document, GlbError};

/// More elements than any vertex buffer of a character has.
pub const MAX_ELEMENTS: usize = 8_000_000;

/// Bytes of a buffer view or accessor, and how its elements follow each other.
struct Raw<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

impl Document<'_> {
    /// The elements of accessor `index` as floats, `[element][component]`. Normalised integers become
    /// -1 to 1 or 0 to 1, other integers their value.
    ///
    /// # Errors
    /// [`GlbError`] where it is no `kind`, has other than `N` components, or lies outside the file.
    pub fn floats<const N: usize>(
        &self,
        index: usize,
        kind: Type,
    ) -> Result<Vec<[f32; N]>, GlbError> {
        let normalized = self.accessor(index)?.normalized;
        let component = self.component_type(index)?;
        self.read(index, kind, |bytes| as_float(component, normalized, bytes))
    }

    /// The elements of accessor `index` as unsigned integers, `[element][component]`.
    ///
    /// # Errors
    /// [`GlbError`] as [`Self::floats`], and where it holds other than unsigned integers.
    pub fn integers<const N: usize>(
        &self,
        index: usize,
        kind: Type,
    ) -> Result<Vec<[u32; N]>, GlbError> {
        let component = self.component_type(index)?;
        let is_unsigned = matches!(
            component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        );
        if !is_unsigned {
            return Err(bad(index, "unsigned integers"));
        }
        self.read(index, kind, |bytes| as_integer(component, bytes))
    }

    fn read<T: Copy + Default, const N: usize>(
        &self,
        index: usize,
        kind: Type,
        value: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, GlbError> {
        let accessor = self.accessor(index)?;
        if accessor.type_ != Checked::Valid(kind) || kind.multiplicity() != N {
            return Err(bad(index, format!("{kind:?}")));
        }
        let component_size = self.component_type(index)?.size();
        let size = component_size * N;
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        if count > MAX_ELEMENTS {
            return Err(bad(
                index,
                format!("at most {MAX_ELEMENTS} elements, got {count}"),
            ));
        }
        let element = |bytes: &[u8]| -> [T; N] {
            let mut parts = bytes.chunks_exact(component_size);
            std::array::from_fn(|_| parts.next().map(&value).unwrap_or_default())
        };
        let mut values = match accessor.buffer_view {
            None => vec![[T::default(); N]; count],
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                let offset = usize::try_from(offset).unwrap_or(usize::MAX);
                let raw = self.view(view.value(), size)?;
                elements(&raw, offset, size, count)
                    .ok_or_else(|| bad(index, "data inside the BIN chunk"))?
                    .map(element)
                    .collect()
            }
        };
        self.put_sparse(index, size, &mut values, element)?;
        Ok(values)
    }

    /// Replaces the elements that a sparse accessor gives apart.
    fn put_sparse<T, const N: usize>(
        &self,
        index: usize,
        size: usize,
        values: &mut [[T; N]],
        element: impl Fn(&[u8]) -> [T; N],
    ) -> Result<(), GlbError> {
        let Some(sparse) = &self.accessor(index)?.sparse else {
            return Ok(());
        };
        let sparse_bad = || bad(index, "sparse elements inside the file");
        let count = usize::try_from(sparse.count.0).map_err(|_| sparse_bad())?;
        let at = |offset: gltf::json::validation::USize64| usize::try_from(offset.0).ok();
        let Checked::Valid(index_type) = &sparse.indices.component_type else {
            return Err(sparse_bad());
        };
        let index_type = match index_type.0 {
            gltf::json::accessor::ComponentType::U8 => ComponentType::U8,
            gltf::json::accessor::ComponentType::U16 => ComponentType::U16,
            _ => ComponentType::U32,
        };
        let indices = self.view(sparse.indices.buffer_view.value(), index_type.size())?;
        let replaced = self.view(sparse.values.buffer_view.value(), size)?;
        let index_offset = at(sparse.indices.byte_offset).ok_or_else(sparse_bad)?;
        let value_offset = at(sparse.values.byte_offset).ok_or_else(sparse_bad)?;
        let indices = elements(&indices, index_offset, index_type.size(), count);
        let replaced = elements(&replaced, value_offset, size, count);
        for (place, bytes) in indices
            .ok_or_else(sparse_bad)?
            .zip(replaced.ok_or_else(sparse_bad)?)
        {
            let place = as_integer(index_type, place) as usize;
            *values.get_mut(place).ok_or_else(sparse_bad)? = element(bytes);
        }
        Ok(())
    }

    /// A buffer view whose elements have `size` bytes.
    fn view(&self, index: usize, size: usize) -> Result<Raw<'_>, GlbError> {
        let bad = |expected: &str| GlbError::new(format!("buffer view {index}"), expected);
        #[cfg(feature = "meshopt")]
        if let Some(compression) = self.compressions.get(&index) {
            return Ok(Raw {
                bytes: Cow::Owned(compression.decompressed(index, &self.binary)?),
                stride: compression.byte_stride,
            });
        }
        let view = self.root.buffer_views.get(index);
        let view = view.ok_or_else(|| bad("a buffer view"))?;
        if view.buffer.value() != 0 {
            return Err(bad(
                "data in the file's own buffer, neither compressed nor in a file beside it",
            ));
        }
        let start = usize::try_from(view.byte_offset.map_or(0, |offset| offset.0));
        let length = usize::try_from(view.byte_length.0);
        let bytes = match (start, length) {
            (Ok(start), Ok(length)) => start
                .checked_add(length)
                .and_then(|end| self.binary.get(start..end)),
            _ => None,
        };
        Ok(Raw {
            bytes: Cow::Borrowed(bytes.ok_or_else(|| bad("data inside the BIN chunk"))?),
            stride: view.byte_stride.map_or(size, |stride| stride.0),
        })
    }
}

fn bad(index: usize, expected: impl Into<String>) -> GlbError {
    GlbError::new(format!("accessor {index}"), expected)
}

/// `count` elements of `size` bytes from `offset`; none where they do not lie inside.
fn elements<'a>(
    raw: &'a Raw<'_>,
    offset: usize,
    size: usize,
    count: usize,
) -> Option<impl Iterator<Item = &'a [u8]> + use<'a>> {
    let bytes = raw.bytes.get(offset..)?;
    let stride = raw.stride;
    let needed = match count {
        0 => 0,
        _ => (count - 1).checked_mul(stride)?.checked_add(size)?,
    };
    (stride >= size && bytes.len() >= needed)
        .then(|| (0..count).map(move |idx| &bytes[idx * stride..idx * stride + size]))
}

/// The first bytes of a component, which has as many.
fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut out = [0; N];
    for (out, byte) in out.iter_mut().zip(bytes) {
        *out = *byte;
    }
    out
}

fn as_float(component: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, most) = match component {
        ComponentType::I8 => (f32::from(i8::from_le_bytes(first(bytes))), 127.0),
        ComponentType::U8 => (f32::from(u8::from_le_bytes(first(bytes))), 255.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes(first(bytes))), 32_767.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes(first(bytes))), 65_535.0),
        ComponentType::U32 => (u32::from_le_bytes(first(bytes)) as f32, u32::MAX as f32),
        ComponentType::F32 => return f32::from_le_bytes(first(bytes)),
    };
    if normalized {
        (value / most).max(-1.0)
    } else {
        value
    }
}

fn as_integer(component: ComponentType, bytes: &[u8]) -> u32 {
    match component {
        ComponentType::U8 => u32::from(u8::from_le_bytes(first(bytes))),
        ComponentType::U16 => u32::from(u16::from_le_bytes(first(bytes))),
        _ => u32::from_le_bytes(first(bytes)),
    }
}
