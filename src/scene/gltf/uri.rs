//! References to data outside the JSON: a file beside the scene, or base64 in a `data:` URI.
//!
//! A scene file comes from anywhere, so a reference may name nothing but a file in or below the scene's own folder:
//! it is decoded and checked before anything is opened.

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::problem::File;
use crate::error::Result;

/// Standard base64, with or without padding: exporters differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes that `uri`, standing in `field`, refers to; `fetch` opens a file beside the scene.
pub fn resolve(file: File, field: &str, uri: &str, fetch: &mut dyn FnMut(&str) -> Result<Vec<u8>>) -> Result<Vec<u8>> {
    match uri.get(..5).filter(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        Some(_) => data(file, field, uri),
        None => fetch(&beside(file, field, uri)?).map_err(|error| error.in_field(field)),
    }
}

/// Decodes `data:<media type>;base64,<text>`.
fn data(file: File, field: &str, uri: &str) -> Result<Vec<u8>> {
    let (head, text) = uri.split_once(',').ok_or_else(|| file.bad(field, uri, "data:<media type>;base64,<text>"))?;
    if !head.ends_with(";base64") {
        return Err(file.bad(field, uri, "a data URI in base64"));
    }
    BASE64.decode(text).map_err(|error| file.bad(field, uri, format!("valid base64 ({error})")))
}

/// The decoded path of a file in or below the folder of the scene.
fn beside(file: File, field: &str, uri: &str) -> Result<String> {
    let bad = |why: &str| file.bad(field, uri, format!("a file beside the scene ({why})"));
    let path = percent_decode_str(uri).decode_utf8().map_err(|_| bad("its name is not UTF-8"))?;
    if path.is_empty() {
        return Err(bad("it names no file"));
    }
    // A colon starts a port, a drive or a scheme; a scene that needs one in a file name is rarer than an attack.
    if path.contains(':') {
        return Err(bad("schemes and drives are not followed"));
    }
    if path.starts_with('/') || path.contains('\\') {
        return Err(bad("absolute paths and backslashes are refused"));
    }
    if path.split('/').any(|part| part == "..") {
        return Err(bad("`..` is refused"));
    }
    if path.contains(char::is_control) {
        return Err(bad("control characters are refused"));
    }
    Ok(path.into_owned())
}
