//! Results as decoded bits: channels of the maps, text of the tables, digest of the summary.

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Maps of the job, each of ten channels, and its tables.
const MAPS: [&str; 3] = ["view", "eye", "wall"];
const CHANNELS: usize = 11;
const TABLES: [&str; 4] = ["table_height", "floor", "points", "regions"];

/// All numbers of a results folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Bits {
    /// `results_digest` of the summary.
    pub digest: String,
    /// Samples by `map.channel`.
    pub channels: BTreeMap<String, Vec<u32>>,
    /// Text of every table.
    pub tables: BTreeMap<String, String>,
}

impl Bits {
    pub fn of(dir: &Path) -> Bits {
        let digest = summary(dir)["results_digest"].as_str().unwrap().to_owned();
        let channels = MAPS.iter().flat_map(|map| read_map(dir, map)).collect();
        let table = |name: &&str| (name.to_string(), fs::read_to_string(dir.join(format!("{name}.csv"))).unwrap());
        Bits { digest, channels, tables: TABLES.iter().map(table).collect() }
    }

    /// Demands equality, naming the first part that differs.
    #[track_caller]
    pub fn assert_same(&self, other: &Bits) {
        self.assert_same_receivers(other);
        assert_eq!(self.digest, other.digest, "digest of the results");
    }

    /// The same receivers show the same bits; the digest may cover others besides.
    #[track_caller]
    pub fn assert_same_receivers(&self, other: &Bits) {
        assert!(self.channels.keys().eq(other.channels.keys()) && self.channels.len() == MAPS.len() * CHANNELS);
        for (name, samples) in &self.channels {
            let differing = samples.iter().zip(&other.channels[name]).filter(|(a, b)| a != b).count();
            assert!(*samples == other.channels[name], "{name}: {differing} of {} samples differ", samples.len());
        }
        assert_eq!(self.tables, other.tables);
    }
}

pub fn summary(dir: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(dir.join("summary.json")).unwrap()).unwrap()
}

/// Bits of the samples of every channel of a map.
pub fn read_map(dir: &Path, map: &str) -> Vec<(String, Vec<u32>)> {
    let image = read_all_flat_layers_from_file(dir.join(format!("{map}.exr"))).unwrap();
    assert_eq!(image.layer_data.len(), 1);
    let bits = |samples: &FlatSamples| match samples {
        FlatSamples::F32(samples) => samples.iter().map(|x| x.to_bits()).collect(),
        other => panic!("{map}: samples are not 32-bit float: {other:?}"),
    };
    let channels = &image.layer_data[0].channel_data.list;
    channels.iter().map(|c| (format!("{map}.{}", c.name), bits(&c.sample_data))).collect()
}

/// A text attribute of a map.
pub fn attribute(dir: &Path, map: &str, name: &str) -> String {
    use exr::prelude::AttributeValue;
    let image = read_all_flat_layers_from_file(dir.join(format!("{map}.exr"))).unwrap();
    let attributes = &image.layer_data[0].attributes.other;
    match attributes.iter().find(|(key, _)| *key == name).map(|(_, value)| value) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{map}.exr: {name}: {other:?}"),
    }
}
