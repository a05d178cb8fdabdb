//! Checkpoint file -> header, blocks, tally.

use super::columns::{decode_moments, decode_scores};
use super::header::longest;
use super::{Checksum, Content, Header, MAGIC, PREAMBLE, Section, VERSION};
use super::{block_count, block_range, checksum, part_count, part_range, tally_sections};
use crate::error::{Error, Result};
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use crate::job::{Kept, SetShape};
use crate::tally::{FLUX_BINS, MomentBlock, Moments, Monitor, Replicates, SetTally, Tally};
use nix::fcntl::{PosixFadviseAdvice, posix_fadvise};
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// As much as the system reads at one wish \[bytes\].
const STRIDE: u64 = 1 << 20;

/// An open checkpoint of a known plan and span, its header checked.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    file: File,
    header: Header,
    /// Where the sections begin \[bytes\].
    base: u64,
    shapes: Vec<SetShape>,
}

/// The header of the checkpoint of `shard` at `path`; None without a file.
///
/// # Errors
/// As [`Reader::open`].
pub fn read_header(path: &Path, plan: &Plan, shard: u64) -> Result<Option<Header>> {
    Ok(Reader::open(path, plan, shard)?.map(|reader| reader.header))
}

/// The header of the compaction in `folder`; None where there is none.
///
/// # Errors
/// As [`Reader::open`].
pub fn read_compaction(folder: &Folder, plan: &Plan) -> Result<Option<Header>> {
    Ok(Reader::open_compaction(&folder.compaction_path(), plan)?.map(|reader| reader.header))
}

/// How far shard `k` is by the files in `folder`: what its compaction says, of which `folded` are the parts, or else the
/// header of the shard's own checkpoint; None where it has not begun.
///
/// # Errors
/// As [`Reader::open`].
pub fn read_progress(folder: &Folder, plan: &Plan, folded: &[Header], k: u64) -> Result<Option<Header>> {
    let part = usize::try_from(k).ok().and_then(|k| folded.get(k));
    part.map_or_else(|| read_header(&folder.shard_path(k), plan, k), |part| Ok(Some(part.clone())))
}

impl Reader {
    /// Opens the checkpoint of `shard` of `plan` at `path`; None without a file.
    ///
    /// # Errors
    /// [`Error::Refused`] for a file that is damaged, of a newer version, or of another plan or shard;
    /// [`Error::Io`].
    pub fn open(path: &Path, plan: &Plan, shard: u64) -> Result<Option<Reader>> {
        Reader::open_span(path, plan, Some(shard))
    }

    /// Opens a compaction of `plan` at `path`; None without a file.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn open_compaction(path: &Path, plan: &Plan) -> Result<Option<Reader>> {
        Reader::open_span(path, plan, None)
    }

    /// The file of a shard, or of no single one.
    fn open_span(path: &Path, plan: &Plan, span: Option<u64>) -> Result<Option<Reader>> {
        let mut file = match File::open(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            other => other.map_err(Error::io(path))?,
        };
        let size = file.metadata().map_err(Error::io(path))?.len();
        let shapes = plan.sets();
        let longest = longest(plan, span, &shapes);
        let (header, base) = read_start(&mut file, size, longest).map_err(|fault| fault.at(path))?;
        header.check(plan, span, &shapes).map_err(|reason| Error::refused(path, reason))?;
        check_sections(&header, size - base).map_err(|reason| Error::refused(path, reason))?;
        Ok(Some(Reader { path: path.to_owned(), file, header, base, shapes }))
    }

    /// What the file says about itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// One block of moments of a set.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn moments(&self, set: usize, block: u32) -> Result<MomentBlock> {
        let shape = &self.shapes[set];
        let colour = shape.kept == Kept::Moments { colour: true };
        let bins = block_range(shape, block).len();
        let content = Content::Moments { set: number(set), block };
        self.section(content, |bytes| decode_moments(bytes, bins, colour), |b| b.has_shape(bins, colour))
    }

    /// Every batch's score of a set.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn replicates(&self, set: usize) -> Result<Replicates> {
        let mut all = self.extremes(set)?;
        for part in 0..part_count(self.bins_of(set), self.header.batches()) {
            let [value, direct] = self.scores(set, part)?;
            all.value.extend(value);
            all.direct.extend(direct);
        }
        Ok(all)
    }

    /// The flux balance, every batch.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn flux(&self) -> Result<Replicates> {
        self.replicates(self.shapes.len())
    }

    /// Some scores and direct parts of a set of which every batch is kept, or of the flux balance after the last set.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn scores(&self, set: usize, part: u32) -> Result<[Vec<f64>; 2]> {
        let bins = self.bins_of(set);
        let entries = part_range(bins, self.header.batches(), part).len();
        let content = Content::Scores { set: number(set), part };
        self.section(content, |bytes| decode_scores(bytes, entries), |_| true)
    }

    /// What such a set keeps of all its batches together, as of no batch.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn extremes(&self, set: usize) -> Result<Replicates> {
        let bins = self.bins_of(set);
        let fits = |(peak, caustic, existed): &(Vec<f64>, Vec<f64>, Vec<u64>)| {
            [peak.len(), caustic.len(), existed.len()] == [bins; 3]
        };
        let (peak, caustic, existed) = self.section(Content::Extremes { set: number(set) }, decode, fits)?;
        Ok(Replicates { peak, caustic, existed, ..Replicates::new(bins) })
    }

    /// Number of bins of a set, or of the flux balance after the last set.
    fn bins_of(&self, set: usize) -> usize {
        self.shapes.get(set).map_or(FLUX_BINS.len(), SetShape::bins)
    }

    /// Direct light of a set that is the same in every batch; empty for zero everywhere.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn fixed_direct(&self, set: usize) -> Result<Vec<f64>> {
        let bins = self.shapes[set].bins();
        let fits = |v: &Vec<f64>| v.is_empty() || v.len() == bins;
        self.section(Content::FixedDirect { set: number(set) }, decode, fits)
    }

    /// The monitored bins of a set, in their order; none where nothing is monitored.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn monitors(&self, set: usize) -> Result<Vec<Monitor>> {
        let (bins, batches) = (self.shapes[set].monitored.clone(), self.header.batches());
        if bins.is_empty() {
            return Ok(Vec::new());
        }
        let fits = |m: &Vec<Monitor>| {
            m.len() == bins.len() && m.iter().zip(&bins).all(|(monitor, &bin)| monitor.has_shape(bin, batches))
        };
        self.section(Content::Monitors { set: number(set) }, decode, fits)
    }

    /// Checksums of the sections of fixed direct light, in set order: equal exactly when the light is.
    pub fn fixed_direct_checksums(&self) -> Vec<Checksum> {
        let fixed = self.header.sections.iter().filter(|s| matches!(s.content, Content::FixedDirect { .. }));
        fixed.map(|s| s.checksum).collect()
    }

    /// The whole tally, to go on from it.
    ///
    /// # Errors
    /// [`Error::Refused`] for damage; [`Error::Io`].
    pub fn tally(&self) -> Result<Tally> {
        let sets = (0..self.shapes.len()).map(|set| self.set_tally(set)).collect::<Result<_>>()?;
        let monitors = (0..self.shapes.len()).map(|set| self.monitors(set)).collect::<Result<_>>()?;
        Ok(Tally { sets, monitors, flux: self.flux()?, digests: self.header.digests.clone() })
    }

    fn set_tally(&self, set: usize) -> Result<SetTally> {
        let shape = self.shapes[set].clone();
        let Kept::Moments { colour } = shape.kept else { return Ok(SetTally::Replicates(self.replicates(set)?)) };
        let mut moments = Moments { n: self.header.batches(), bins: MomentBlock::new(0, colour) };
        for block in 0..block_count(&shape) {
            moments.bins.append(self.moments(set, block)?);
        }
        Ok(SetTally::Moments(moments))
    }

    /// Asks the system to fetch `blocks` of a set from the disk, without waiting for them. Only a wish: where it is not
    /// heard, whoever reads a block waits.
    pub fn fetch(&self, set: usize, blocks: Range<u32>) {
        let section = |block: u32| self.header.sections[self.position(Content::Moments { set: number(set), block })];
        let Some(last) = blocks.clone().last().map(section) else { return };
        for at in (section(blocks.start).offset..last.offset + last.bytes).step_by(STRIDE as usize) {
            let (at, length) = ((self.base + at) as i64, STRIDE as i64);
            let _ = posix_fadvise(&self.file, at, length, PosixFadviseAdvice::POSIX_FADV_WILLNEED);
        }
    }

    /// Reads, verifies and decodes the section holding `content`.
    fn section<T>(
        &self,
        content: Content,
        decode: impl Fn(&[u8]) -> Option<T>,
        fits: impl Fn(&T) -> bool,
    ) -> Result<T> {
        let section = self.header.sections[self.position(content)];
        let bytes = self.read(&section).map_err(|e| Fault::from(e).at(&self.path))?;
        if checksum(&bytes) != section.checksum {
            return Err(Error::refused(&self.path, format!("damaged: wrong checksum of {content:?}")));
        }
        let decoded = decode(&bytes).filter(|t| fits(t));
        decoded.ok_or_else(|| Error::refused(&self.path, format!("damaged: {content:?} is not of the plan's shape")))
    }

    /// The bytes of `section`, a length already checked against the size of the file.
    fn read(&self, section: &Section) -> io::Result<Vec<u8>> {
        let mut bytes = zeros(section.bytes)?;
        self.file.read_exact_at(&mut bytes, self.base + section.offset)?;
        Ok(bytes)
    }

    /// Where `content` stands in the table, which was checked to be the layout of the plan.
    fn position(&self, content: Content) -> usize {
        let batches = self.header.batches();
        let before = |set: u32| -> usize {
            self.shapes[..set as usize].iter().map(|shape| tally_sections(shape, batches)).sum()
        };
        let behind_flux = || before(self.shapes.len() as u32) + part_count(FLUX_BINS.len(), batches) as usize + 1;
        match content {
            Content::Moments { set, block } => before(set) + block as usize,
            Content::Scores { set, part } => before(set) + part as usize,
            Content::Extremes { set } => before(set) + part_count(self.bins_of(set as usize), batches) as usize,
            Content::FixedDirect { set } => behind_flux() + set as usize,
            Content::Monitors { set } => {
                let monitored = self.shapes[..set as usize].iter().filter(|s| !s.monitored.is_empty());
                behind_flux() + self.shapes.len() + monitored.count()
            }
        }
    }
}

/// Why reading failed: the system, or the file.
enum Fault {
    Io(io::Error),
    Bad(String),
}

impl From<io::Error> for Fault {
    fn from(e: io::Error) -> Self {
        match e.kind() {
            ErrorKind::UnexpectedEof => Fault::Bad("damaged: truncated".to_owned()),
            _ => Fault::Io(e),
        }
    }
}

impl Fault {
    fn at(self, path: &Path) -> Error {
        match self {
            Fault::Io(e) => Error::io(path)(e),
            Fault::Bad(reason) => Error::refused(path, reason),
        }
    }
}

/// Magic, version, header and checksum of a file of `size` bytes; with the header, where the sections begin.
fn read_start(file: &mut File, size: u64, longest: u64) -> std::result::Result<(Header, u64), Fault> {
    let bad = |reason: &str| Err(Fault::Bad(reason.to_owned()));
    let preamble = read_exactly(file, (PREAMBLE as u64).min(size))?;
    if preamble.len() < PREAMBLE || preamble[..8] != MAGIC {
        return bad(if preamble.is_empty() { "damaged: empty" } else { "not a checkpoint of lampyris" });
    }
    let word = |at: usize| u32::from_le_bytes(preamble[at..at + 4].try_into().expect("a slice of four bytes"));
    let (version, length) = (word(8), word(12));
    if version != VERSION {
        let age = if version > VERSION { "newer" } else { "unknown" };
        return Err(Fault::Bad(format!("format version {version} is {age}; this program reads version {VERSION}")));
    }
    let base = PREAMBLE as u64 + u64::from(length) + size_of::<Checksum>() as u64;
    if base > size {
        return bad("damaged: truncated, or a wrong header length");
    }
    if u64::from(length) > longest {
        return bad("damaged, or of another plan: its header is longer than any of this plan");
    }
    let mut bytes = zeros(PREAMBLE as u64 + u64::from(length))?;
    bytes[..PREAMBLE].copy_from_slice(&preamble);
    file.read_exact(&mut bytes[PREAMBLE..])?;
    let sum = read_exactly(file, size_of::<Checksum>() as u64)?;
    if checksum(&bytes)[..] != sum[..] {
        return bad("damaged: wrong checksum of the header");
    }
    match decode(&bytes[PREAMBLE..]) {
        Some(header) => Ok((header, base)),
        None => bad("damaged: the header cannot be decoded"),
    }
}

/// Sections lie end to end and end with the file of which `available` bytes remain: no gaps, no trailing bytes.
fn check_sections(header: &Header, available: u64) -> std::result::Result<(), String> {
    let mut end = 0u64;
    for section in &header.sections {
        if section.offset != end {
            return Err("damaged: its sections do not lie end to end".to_owned());
        }
        end = end.checked_add(section.bytes).ok_or("damaged: impossible section length")?;
    }
    match available.cmp(&end) {
        std::cmp::Ordering::Less => Err("damaged: truncated".to_owned()),
        std::cmp::Ordering::Equal => Ok(()),
        std::cmp::Ordering::Greater => Err(format!("damaged: {} trailing bytes", available - end)),
    }
}

/// Exactly `length` bytes, a length already checked against the size of the file.
fn read_exactly(file: &mut File, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = zeros(length)?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn zeros(length: u64) -> io::Result<Vec<u8>> {
    let length = usize::try_from(length).map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
    Ok(vec![0; length])
}

/// All of `bytes` as one value: a prefix is not enough. A hostile length inside cannot allocate much: serde
/// reserves at most a mebibyte ahead of the bytes that are really there.
fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    rest.is_empty().then_some(value)
}

fn number(set: usize) -> u32 {
    u32::try_from(set).expect("a job has fewer than 2^32 receiver sets")
}
