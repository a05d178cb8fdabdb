//! Writes the segments of `scripts/bench/segments.rs` for other programs:
//! `cargo run --release --example segments -- FOLDER` makes `R.bin`, `M.bin` and `L.bin` of 512 x 512 receivers and
//! 8 vertices.

#[path = "../segments.rs"]
mod segments;

use segments::{Scene, Segments};
use std::fs::File;
use std::io::{BufWriter, Error, Result, Write};
use std::path::PathBuf;

const SIDE: u32 = 512;
const VERTICES: usize = 8;

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1).map(PathBuf::from).ok_or_else(|| Error::other("say into which folder"))?;
    for scene in Scene::ALL {
        let segments = Segments::new(scene, SIDE, VERTICES);
        let path = folder.join(format!("{}.bin", scene.letter()));
        let mut file = BufWriter::new(File::create(&path)?);
        segments.write(&mut file)?;
        file.flush()?;
        println!("{}: {} triangles", path.display(), segments.triangles.len());
    }
    Ok(())
}
