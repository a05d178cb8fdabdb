//! Textures: an image of the file, decoded once, and how a material lays it on a surface.

use std::collections::HashMap;
use std::sync::Arc;

use super::buffers::Buffers;
use super::decode::decode;
use super::document::{Document, Sampler, TextureReference, TextureTransform};
use super::problem::File;
use super::uri;
use crate::error::Result;
use crate::math::{DVec2, sin_cos};
use crate::scene::textures::{Coding, Filter, Image, Layer, Transform, Wrap};

/// Largest memory of all images of a scene \[bytes\].
const MOST_BYTES: u64 = 1 << 30;
/// Largest number in a transform: positions in an image keep some digits.
const FARTHEST: f64 = 1e6;

/// The images of the file, each decoded at most once.
pub struct Images<'a> {
    file: File<'a>,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    fetch: &'a mut dyn FnMut(&str) -> Result<Vec<u8>>,
    decoded: HashMap<usize, Arc<Image>>,
    bytes: u64,
}

impl<'a> Images<'a> {
    /// Nothing is read before it is asked for.
    pub fn new(
        file: File<'a>,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        fetch: &'a mut dyn FnMut(&str) -> Result<Vec<u8>>,
    ) -> Self {
        Images { file, document, buffers, fetch, decoded: HashMap::new(), bytes: 0 }
    }

    /// The texture that `reference` names, which stands in `field`; the layer's set is the number in TEXCOORD_n.
    pub fn layer(&mut self, reference: &TextureReference, field: &str, coding: Coding) -> Result<Layer> {
        let path = format!("{field}.index");
        let texture = self.file.item(&self.document.textures, "textures", reference.index, path)?;
        let sampler = match texture.sampler {
            Some(index) => {
                let path = format!("textures[{}].sampler", reference.index);
                Some(self.file.item(&self.document.samplers, "samplers", index, path)?)
            }
            None => None,
        };
        let (filter, wrap) = self.sampling(sampler, texture.sampler.unwrap_or(0))?;
        let transform = reference.extensions.transform.as_ref();
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(reference.tex_coord);
        let transform = match transform {
            Some(transform) => self.transform(transform, &format!("{field}.extensions.KHR_texture_transform"))?,
            None => Transform::IDENTITY,
        };
        let image = self.image(reference.index)?;
        Ok(Layer { image, coding, filter, wrap, set, transform })
    }

    /// Mean over the image of the texture that `reference` names, which stands in `field`.
    pub fn mean(&mut self, reference: &TextureReference, field: &str, coding: Coding) -> Result<[f64; 4]> {
        self.file.item(&self.document.textures, "textures", reference.index, format!("{field}.index"))?;
        Ok(self.image(reference.index)?.mean(coding))
    }

    /// The image of texture `index`, which exists.
    fn image(&mut self, index: usize) -> Result<Arc<Image>> {
        let texture = &self.document.textures[index];
        let path = format!("textures[{index}].source");
        let Some(source) = texture.source else {
            let allowed = match texture.extensions.keys().next() {
                Some(extension) => {
                    format!(
                        "a PNG or JPEG image beside that of {extension}: export the scene with PNG or JPEG textures"
                    )
                }
                None => "a PNG or JPEG image".to_owned(),
            };
            return Err(self.file.bad(path, "none", allowed));
        };
        let image = self.file.item(&self.document.images, "images", source, &path)?;
        if let Some(image) = self.decoded.get(&source) {
            return Ok(image.clone());
        }
        let bytes = self.bytes(source)?;
        let path = format!("images[{source}]");
        let decoded = decode(&bytes).map_err(|reason| {
            let called = [&image.name, &image.uri, &texture.name].into_iter().find_map(Option::as_deref);
            self.file.bad(&path, called.unwrap_or("no name"), format!("a PNG or JPEG image ({reason})"))
        })?;
        self.bytes += decoded.bytes();
        if self.bytes > MOST_BYTES {
            let allowed = format!("at most {MOST_BYTES} bytes in all images");
            return Err(self.file.bad(path, format_args!("{} bytes of texels", self.bytes), allowed));
        }
        let image = Arc::new(decoded);
        self.decoded.insert(source, image.clone());
        Ok(image)
    }

    /// The encoded bytes of image `index`.
    fn bytes(&mut self, index: usize) -> Result<Vec<u8>> {
        let image = &self.document.images[index];
        let path = format!("images[{index}]");
        match (&image.uri, image.buffer_view) {
            (Some(uri), None) => uri::resolve(self.file, &format!("{path}.uri"), uri, &mut *self.fetch),
            (None, Some(view)) => Ok(self.buffers.view(view, &format!("{path}.bufferView"))?.to_vec()),
            _ => Err(self.file.bad(path, "no source or two", "either `uri` or `bufferView`")),
        }
    }

    /// What `sampler`, number `index`, says; glTF leaves the filter of a texture without one to us.
    fn sampling(&self, sampler: Option<&Sampler>, index: usize) -> Result<(Filter, [Wrap; 2])> {
        let Some(sampler) = sampler else { return Ok((Filter::Bilinear, [Wrap::Repeat; 2])) };
        let path = format!("samplers[{index}]");
        let filter = match sampler.mag_filter {
            Some(9728) => Filter::Nearest,
            None | Some(9729) => Filter::Bilinear,
            Some(other) => return Err(self.file.bad(format_args!("{path}.magFilter"), other, "9728 or 9729")),
        };
        let wrap = |name: &str, code: u64| match code {
            33071 => Ok(Wrap::Clamp),
            33648 => Ok(Wrap::Mirror),
            10497 => Ok(Wrap::Repeat),
            other => Err(self.file.bad(format_args!("{path}.{name}"), other, "33071, 33648 or 10497")),
        };
        Ok((filter, [wrap("wrapS", sampler.wrap_s)?, wrap("wrapT", sampler.wrap_t)?]))
    }

    /// offset + rotation of the scaled coordinates, the rotation counter-clockwise as one looks at the image.
    fn transform(&self, transform: &TextureTransform, path: &str) -> Result<Transform> {
        let within =
            |name: &str, value| self.file.all_between(format_args!("{path}.{name}"), value, -FARTHEST, FARTHEST);
        let offset = within("offset", transform.offset)?;
        let [x, y] = within("scale", transform.scale)?;
        let rotation = self.file.between(format_args!("{path}.rotation"), transform.rotation, -FARTHEST, FARTHEST)?;
        let (sin, cos) = sin_cos(rotation);
        let (u, v) = (DVec2::new(cos, -sin) * x, DVec2::new(sin, cos) * y);
        Ok(Transform { u, v, offset: DVec2::from_array(offset) })
    }
}
