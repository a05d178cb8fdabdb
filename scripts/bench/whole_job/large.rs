//! A scene of about a million triangles: eight bumpy spheres in a room, one GLB file.

use lampyris::math::{DVec3, PI, sin_cos};
use serde_json::{Value, json};

/// Steps of a sphere from pole to pole, and around: 2 x 250 x 250 triangles each.
const STEPS: u32 = 250;
/// The room \[m\]: x from 0, y from 0, z from 0.
const ROOM: [f64; 3] = [6.0, 3.0, 4.0];

/// A file under construction.
#[derive(Default)]
struct File {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
}

/// The bytes of the scene, and the number of its triangles.
pub fn glb() -> (Vec<u8>, u64) {
    let mut file = File::default();
    let (corners, walls) = room();
    file.mesh(&corners, &walls);
    let mut triangles = walls.len();
    for i in 0..8 {
        let center =
            DVec3::new(1.0 + 1.3 * f64::from(i % 4), 0.7 + 0.2 * f64::from(i % 3), 1.2 + 1.6 * f64::from(i / 4));
        let (positions, faces) = bumpy_sphere(center, 0.5, f64::from(5 + i));
        triangles += faces.len();
        file.mesh(&positions, &faces);
    }
    (file.bytes(), triangles as u64)
}

/// The walls, seen from inside.
fn room() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { ROOM[axis] as f32 } else { 0.0 });
    let quads = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), faces.collect())
}

/// A sphere whose radius swings by a tenth, `waves` times around.
fn bumpy_sphere(center: DVec3, radius: f64, waves: f64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for row in 0..=STEPS {
        for column in 0..STEPS {
            let (down, around) =
                (PI * f64::from(row) / f64::from(STEPS), 2.0 * PI * f64::from(column) / f64::from(STEPS));
            let ((sd, cd), (sa, ca)) = (sin_cos(down), sin_cos(around));
            let bump = 1.0 + 0.1 * sin_cos(waves * around).0 * sin_cos(waves * down).0;
            let at = center + DVec3::new(sd * ca, cd, sd * sa) * radius * bump;
            positions.push(at.to_array().map(|x| x as f32));
        }
    }
    let vertex = |row: u32, column: u32| row * STEPS + column % STEPS;
    let quads = (0..STEPS).flat_map(|row| (0..STEPS).map(move |column| (row, column)));
    let faces = quads.flat_map(|(r, c)| {
        let [a, b, d, e] = [vertex(r, c), vertex(r, c + 1), vertex(r + 1, c + 1), vertex(r + 1, c)];
        [[a, b, d], [a, d, e]]
    });
    (positions, faces.collect())
}

impl File {
    /// Adds a mesh, its positions as f32 and its indices as u32.
    fn mesh(&mut self, positions: &[[f32; 3]], faces: &[[u32; 3]]) {
        let bytes: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let position = self.accessor(&bytes, 5126, positions.len(), "VEC3");
        let bytes: Vec<u8> = faces.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.accessor(&bytes, 5125, 3 * faces.len(), "SCALAR");
        let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices, "material": 0 });
        self.meshes.push(json!({ "primitives": [primitive] }));
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        let view = self.views.len();
        self.views.push(json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() }));
        self.binary.extend_from_slice(bytes);
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": shape }));
        self.accessors.len() - 1
    }

    fn bytes(self) -> Vec<u8> {
        let nodes: Vec<Value> = (0..self.meshes.len()).map(|mesh| json!({ "mesh": mesh })).collect();
        let matt = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0, "baseColorFactor": [0.5, 0.5, 0.5, 1.0] });
        let document = json!({
            "asset": { "version": "2.0" }, "nodes": nodes, "meshes": self.meshes, "accessors": self.accessors,
            "bufferViews": self.views, "buffers": [{ "byteLength": self.binary.len() }],
            "materials": [{ "pbrMetallicRoughness": matt, "doubleSided": true }],
        });
        let mut text = serde_json::to_vec(&document).expect("a JSON value prints");
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.binary.len();
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((length as u32).to_le_bytes());
        for (kind, content) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            glb.extend((content.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(content);
        }
        glb
    }
}
