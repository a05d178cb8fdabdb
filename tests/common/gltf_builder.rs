//! Makes glTF files in memory: JSON that a test may bend, and the binary data it refers to.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// A scene under construction.
#[derive(Clone)]
pub struct Builder {
    /// The JSON, without its first buffer.
    pub json: Value,
    /// Content of the first buffer.
    pub binary: Vec<u8>,
}

impl Builder {
    /// A file with nothing in it.
    pub fn new() -> Self {
        let mut json = json!({ "asset": { "version": "2.0" } });
        for list in ["nodes", "meshes", "accessors", "bufferViews", "materials", "cameras", "textures", "images"] {
            json[list] = json!([]);
        }
        Builder { json, binary: Vec::new() }
    }

    /// Appends `value` to the array at `pointer`; its index.
    pub fn push(&mut self, pointer: &str, value: Value) -> usize {
        let list = self.json.pointer_mut(pointer).and_then(Value::as_array_mut).expect("the list exists");
        list.push(value);
        list.len() - 1
    }

    /// Puts `value` at `pointer`, whose parent exists.
    pub fn set(&mut self, pointer: &str, value: Value) -> &mut Self {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer has a slash");
        match self.json.pointer_mut(parent) {
            Some(Value::Array(list)) => list[key.parse::<usize>().expect("an index")] = value,
            Some(object) => object[key] = value,
            None => panic!("{parent} does not exist"),
        }
        self
    }

    /// Removes `key` from the object at `parent`.
    pub fn remove(&mut self, parent: &str, key: &str) -> &mut Self {
        let object = self.json.pointer_mut(parent).and_then(Value::as_object_mut).expect("the object exists");
        object.remove(key).expect("the key exists");
        self
    }

    /// A view of `bytes`, aligned to four.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend_from_slice(bytes);
        self.push("/bufferViews", view)
    }

    /// An accessor over all of `bytes`.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        let view = self.view(bytes);
        let accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": shape });
        self.push("/accessors", accessor)
    }

    /// An accessor of float positions.
    pub fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, positions.len(), "VEC3")
    }

    /// An accessor of 16-bit indices.
    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, indices.len(), "SCALAR")
    }

    /// A mesh of one primitive without material.
    pub fn mesh(&mut self, positions: &[[f32; 3]], indices: Option<&[u16]>) -> usize {
        let position = self.positions(positions);
        let mut primitive = json!({ "attributes": { "POSITION": position } });
        if let Some(indices) = indices {
            primitive["indices"] = json!(self.indices(indices));
        }
        self.push("/meshes", json!({ "primitives": [primitive] }))
    }

    /// A node; its index.
    pub fn node(&mut self, node: Value) -> usize {
        self.push("/nodes", node)
    }

    /// A light of KHR_lights_punctual; its index.
    pub fn light(&mut self, light: Value) -> usize {
        if self.json.get("extensions").is_none() {
            self.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
            self.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [] } });
        }
        self.push("/extensions/KHR_lights_punctual/lights", light)
    }

    /// The JSON text, its first buffer at `uri`.
    pub fn text(&self, uri: Option<&str>) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.binary.is_empty() && json.get("buffers").is_none() {
            json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
            if let Some(uri) = uri {
                json["buffers"][0]["uri"] = json!(uri);
            }
        }
        serde_json::to_vec(&json).expect("a JSON value prints")
    }

    /// A .gltf that holds its buffer as base64.
    pub fn embedded(&self) -> Vec<u8> {
        self.text(Some(&format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.binary))))
    }

    /// A .glb.
    pub fn glb(&self) -> Vec<u8> {
        let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        chunk(&mut glb, b"JSON", &self.text(None), b' ');
        if !self.binary.is_empty() {
            chunk(&mut glb, b"BIN\0", &self.binary, 0);
        }
        let length = glb.len() as u32;
        glb[8..12].copy_from_slice(&length.to_le_bytes());
        glb
    }
}

/// Appends a chunk of a GLB, padded to four bytes.
fn chunk(glb: &mut Vec<u8>, kind: &[u8; 4], content: &[u8], padding: u8) {
    let length = content.len().next_multiple_of(4);
    glb.extend_from_slice(&(length as u32).to_le_bytes());
    glb.extend_from_slice(kind);
    glb.extend_from_slice(content);
    glb.resize(glb.len() + length - content.len(), padding);
}
