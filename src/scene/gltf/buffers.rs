//! Buffers, views and accessors: raw bytes, each range proved before it is read or anything is allocated for it.

use super::document::{Accessor, BufferView, Document};
use super::problem::File;
use super::uri;
use crate::error::Result;
use crate::math::DVec3;

/// Bytes of every buffer, exactly `byteLength` of each.
pub struct Buffers<'a> {
    file: File<'a>,
    document: &'a Document,
    data: Vec<Vec<u8>>,
}

/// A number type of the binary data.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// The elements of one accessor, proved to lie inside their view.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    component: Component,
    normalized: bool,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of the file; `binary` is the BIN chunk of a GLB.
    pub fn load(
        file: File<'a>,
        document: &'a Document,
        mut binary: Option<&[u8]>,
        fetch: &mut dyn FnMut(&str) -> Result<Vec<u8>>,
    ) -> Result<Self> {
        let mut data = Vec::with_capacity(document.buffers.len());
        for (i, buffer) in document.buffers.iter().enumerate() {
            let field = format!("buffers[{i}].uri");
            let mut bytes = match (&buffer.uri, binary.take()) {
                (Some(uri), _) => uri::resolve(file, &field, uri, fetch)?,
                // Only the first buffer may be the BIN chunk: it was taken above.
                (None, Some(chunk)) => chunk.to_vec(),
                (None, None) => {
                    let allowed =
                        "a URI; only buffers[0] of a .glb does without (compressed buffers are not supported)";
                    return Err(file.bad(field, "none", allowed));
                }
            };
            let length = bytes.len() as u64;
            if buffer.byte_length > length || buffer.byte_length == 0 {
                let allowed = format!("1 .. {length}, the bytes there are");
                return Err(file.bad(format_args!("buffers[{i}].byteLength"), buffer.byte_length, allowed));
            }
            bytes.truncate(buffer.byte_length as usize);
            data.push(bytes);
        }
        Ok(Buffers { file, document, data })
    }

    /// Positions of accessor `index`, which stands in `field` \[m, in the coordinates of its mesh\].
    pub fn positions(&self, index: usize, field: &str) -> Result<Vec<DVec3>> {
        let elements = self.elements(index, field, &["VEC3"])?;
        let path = format!("accessors[{index}]");
        if elements.component == Component::U32 {
            return Err(self.file.bad(format_args!("{path}.componentType"), 5125, "5126 (float), for a position"));
        }
        let mut positions = Vec::with_capacity(elements.count);
        for i in 0..elements.count {
            let position = DVec3::from_array([0, 1, 2].map(|axis| elements.value(i, axis)));
            if !position.is_finite() {
                return Err(self.file.bad(format_args!("{path}, element {i}"), position, "finite coordinates"));
            }
            positions.push(position);
        }
        Ok(positions)
    }

    /// The first `N` components of each element of accessor `index`, which stands in `field` and is one of `shapes`; all finite.
    pub fn rows<const N: usize>(&self, index: usize, field: &str, shapes: &[&str]) -> Result<Vec<[f64; N]>> {
        let elements = self.elements(index, field, shapes)?;
        let path = format!("accessors[{index}]");
        let mut rows = Vec::with_capacity(elements.count);
        for i in 0..elements.count {
            let row: [f64; N] = std::array::from_fn(|axis| elements.value(i, axis));
            if !row.iter().all(|x| x.is_finite()) {
                return Err(self.file.bad(format_args!("{path}, element {i}"), format!("{row:?}"), "finite numbers"));
            }
            rows.push(row);
        }
        Ok(rows)
    }

    /// Colours with alpha, which is 1 where accessor `index`, which stands in `field`, has none.
    pub fn colours(&self, index: usize, field: &str) -> Result<Vec<[f64; 4]>> {
        let shapes = &["VEC3", "VEC4"];
        let accessor = self.file.item(&self.document.accessors, "accessors", index, field)?;
        if accessor.shape == "VEC4" {
            return self.rows::<4>(index, field, shapes);
        }
        Ok(self.rows::<3>(index, field, shapes)?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
    }

    /// Indices of accessor `index`, which stands in `field`; each is below `vertices`.
    pub fn indices(&self, index: usize, field: &str, vertices: usize) -> Result<Vec<u32>> {
        let elements = self.elements(index, field, &["SCALAR"])?;
        let path = format!("accessors[{index}]");
        if !matches!(elements.component, Component::U8 | Component::U16 | Component::U32) || elements.normalized {
            let code = self.document.accessors[index].component_type;
            let allowed = "5121, 5123 or 5125 (unsigned) and not normalized, for an index";
            return Err(self.file.bad(format_args!("{path}.componentType"), code, allowed));
        }
        let mut indices = Vec::with_capacity(elements.count);
        for i in 0..elements.count {
            // Exact: every u32 is an f64.
            let vertex = elements.value(i, 0) as u32;
            if vertex as usize >= vertices {
                let allowed = format!("below {vertices}, the number of vertices");
                return Err(self.file.bad(format_args!("{path}, element {i}"), vertex, allowed));
            }
            indices.push(vertex);
        }
        Ok(indices)
    }

    /// The bytes of view `index`, which stands in `field`.
    pub fn view(&self, index: usize, field: &str) -> Result<&[u8]> {
        let view = self.file.item(&self.document.buffer_views, "bufferViews", index, field)?;
        let path = format!("bufferViews[{index}]");
        let buffer = self.file.item(&self.data, "buffers", view.buffer, format_args!("{path}.buffer"))?;
        let room = (buffer.len() as u64).checked_sub(view.byte_offset).ok_or_else(|| {
            let allowed = format!("0 .. {}, inside its buffer", buffer.len());
            self.file.bad(format_args!("{path}.byteOffset"), view.byte_offset, allowed)
        })?;
        if view.byte_length == 0 || view.byte_length > room {
            let allowed = format!("1 .. {room}, inside its buffer");
            return Err(self.file.bad(format_args!("{path}.byteLength"), view.byte_length, allowed));
        }
        let start = view.byte_offset as usize;
        Ok(&buffer[start..start + view.byte_length as usize])
    }

    /// The elements of accessor `index`, which stands in `field` and must be one of `shapes`.
    fn elements(&self, index: usize, field: &str, shapes: &[&str]) -> Result<Elements<'_>> {
        let accessor = self.file.item(&self.document.accessors, "accessors", index, field)?;
        let path = format!("accessors[{index}]");
        let shape = accessor.shape.as_str();
        if !shapes.contains(&shape) {
            let allowed = format!("{}, for {field}", shapes.join(" or "));
            return Err(self.file.bad(format_args!("{path}.type"), shape, allowed));
        }
        let component = Component::from_code(accessor.component_type).ok_or_else(|| {
            let allowed = "5120, 5121, 5122, 5123, 5125 or 5126";
            self.file.bad(format_args!("{path}.componentType"), accessor.component_type, allowed)
        })?;
        if accessor.sparse.is_some() {
            return Err(self.file.bad(format_args!("{path}.sparse"), "present", "sparse accessors are not supported"));
        }
        let Some(view_index) = accessor.buffer_view else {
            let allowed =
                "an index into `bufferViews` (compressed meshes, as KHR_draco_mesh_compression, are not supported)";
            return Err(self.file.bad(format_args!("{path}.bufferView"), "none", allowed));
        };
        let bytes = self.view(view_index, &format!("{path}.bufferView"))?;
        let view = &self.document.buffer_views[view_index];
        let width = match shape {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
        let stride = self.stride(view, view_index, component.size() * width, shape)?;
        self.aligned(accessor, view, &path, component)?;
        let bytes = self.range(accessor, bytes, &path, stride, component.size() as u64 * width as u64)?;
        let count = accessor.count as usize;
        Ok(Elements { bytes, stride: stride as usize, count, component, normalized: accessor.normalized })
    }

    /// Distance between elements of `size` bytes \[bytes\].
    fn stride(&self, view: &BufferView, index: usize, size: usize, shape: &str) -> Result<u64> {
        let size = size as u64;
        match view.byte_stride {
            None => Ok(size),
            Some(stride) if shape != "SCALAR" && stride >= size && stride <= 252 && stride % 4 == 0 => Ok(stride),
            Some(stride) => {
                let allowed = match shape {
                    "SCALAR" => "none, for indices".to_owned(),
                    _ => format!("a multiple of 4 in {size} .. 252"),
                };
                Err(self.file.bad(format_args!("bufferViews[{index}].byteStride"), stride, allowed))
            }
        }
    }

    /// Proves that elements start on a multiple of the size of a component, as glTF demands.
    fn aligned(&self, accessor: &Accessor, view: &BufferView, path: &str, component: Component) -> Result<()> {
        let size = component.size() as u64;
        if accessor.byte_offset.is_multiple_of(size) && view.byte_offset.is_multiple_of(size) {
            return Ok(());
        }
        let value = format!("{} + {} of its view", accessor.byte_offset, view.byte_offset);
        Err(self.file.bad(format_args!("{path}.byteOffset"), value, format!("multiples of {size}")))
    }

    /// The bytes of `view` from the first element of `accessor` on, proved to hold all of them.
    fn range<'b>(&self, accessor: &Accessor, view: &'b [u8], path: &str, stride: u64, size: u64) -> Result<&'b [u8]> {
        let room = (view.len() as u64).checked_sub(accessor.byte_offset).ok_or_else(|| {
            let allowed = format!("0 .. {}, inside its view", view.len());
            self.file.bad(format_args!("{path}.byteOffset"), accessor.byte_offset, allowed)
        })?;
        // Elements that fit: the last one needs only its own size, not a whole stride.
        let fitting = room.checked_sub(size).map_or(0, |rest| rest / stride + 1);
        if accessor.count == 0 || accessor.count > fitting {
            let allowed = format!("1 .. {fitting}, the elements its view holds");
            return Err(self.file.bad(format_args!("{path}.count"), accessor.count, allowed));
        }
        Ok(&view[accessor.byte_offset as usize..])
    }
}

impl Elements<'_> {
    /// Component `axis` of element `i`.
    fn value(&self, i: usize, axis: usize) -> f64 {
        let size = self.component.size();
        let start = i * self.stride + axis * size;
        let value = self.component.read(&self.bytes[start..start + size]);
        match self.component.full_scale() {
            Some(full) if self.normalized => (value / full).max(-1.0),
            _ => value,
        }
    }
}

impl Component {
    /// The type with glTF's number `code`.
    fn from_code(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    /// Size \[bytes\].
    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// What stands for one in normalized data; floats are never normalized.
    fn full_scale(self) -> Option<f64> {
        match self {
            Component::I8 => Some(i8::MAX.into()),
            Component::U8 => Some(u8::MAX.into()),
            Component::I16 => Some(i16::MAX.into()),
            Component::U16 => Some(u16::MAX.into()),
            Component::U32 | Component::F32 => None,
        }
    }

    /// The number in `bytes`, little-endian and of this size.
    fn read(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Component::I8, &[a]) => i8::from_le_bytes([a]).into(),
            (Component::U8, &[a]) => a.into(),
            (Component::I16, &[a, b]) => i16::from_le_bytes([a, b]).into(),
            (Component::U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
            (Component::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
            (Component::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
            _ => unreachable!("the slice was cut to the size of the component"),
        }
    }
}
