//! The picture: linear premultiplied RGBA in 32-bit floats.

pub mod npy;

use crate::error::{Error, Result};
use crate::memory;
use ::image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};
use std::path::Path;

/// A picture. Row 0 is the top; the background is not in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Premultiplied linear red, green, blue and opacity of each pixel, row by row.
    pub pixels: Vec<[f32; 4]>,
}

/// What an 8-bit picture shows behind the volume. Float pictures (NPY, EXR) keep their opacity instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Backdrop<'a> {
    /// Nothing: the file has an alpha channel.
    Transparent,
    /// One colour, in [0, 1].
    Color([f32; 3]),
    /// A colour for each pixel, row by row from the top: a picture of opaque objects.
    Pixels(&'a [[f32; 3]]),
}

/// How far two pictures are apart, over all channels of all pixels. A NaN in either counts as infinitely far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// The largest absolute difference.
    pub max: f64,
    /// The root of the mean square difference.
    pub rmse: f64,
    /// The mean absolute difference.
    pub mean: f64,
    /// The pixel (column, row) of the largest difference.
    pub at: [u32; 2],
}

impl Image {
    /// An empty (transparent) picture of `size` pixels.
    pub fn new(size: [u32; 2]) -> Self {
        Image { size, pixels: vec![[0.0; 4]; size[0] as usize * size[1] as usize] }
    }

    /// Reads a float picture: `.npy` of shape (h, w, 4), or `.exr` with R, G, B and A.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Malformed`], or [`Error::Unsupported`] for any other ending.
    pub fn open(path: &Path) -> Result<Self> {
        match ending(path).as_str() {
            "npy" => {
                let npy::Npy { shape, values } = npy::Npy::open(path)?;
                let pixels = values.as_chunks().0.iter().map(|p: &[f64; 4]| p.map(|v| v as f32)).collect();
                match shape[..] {
                    [h, w, 4] if w.max(h) <= u32::MAX as usize => Ok(Image { size: [w as u32, h as u32], pixels }),
                    _ => Err(Error::malformed(path, format!("an array of shape {shape:?} is no (h, w, 4) picture"))),
                }
            }
            "exr" => read_exr(path),
            _ => Err(Error::unsupported(path, "only .npy and .exr pictures are read")),
        }
    }

    /// Writes the picture in the format that the path's ending names: `.npy` (float32, shape (h, w, 4)), `.exr` (32-bit
    /// float RGBA) or `.png` (8-bit, linear as the picture is, over `backdrop`). A file is written whole or not at all.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Unsupported`] for any other ending, [`Error::NoMemory`], or [`Error::View`] if the
    /// backdrop has another size.
    pub fn save(&self, path: &Path, backdrop: Backdrop) -> Result<()> {
        let bytes = self.encoded(path, &ending(path), backdrop)?;
        std::fs::write(path, bytes).map_err(|e| {
            // Half a file is worse than none; but a device or pipe is not ours to remove.
            if path.is_file() {
                let _ = std::fs::remove_file(path);
            }
            Error::file(path, e)
        })
    }

    /// The bytes of such a file; `format` is its ending, such as `png`.
    ///
    /// # Errors
    /// As [`Image::save`].
    pub fn encode(&self, format: &str, backdrop: Backdrop) -> Result<Vec<u8>> {
        self.encoded(Path::new("the picture"), format, backdrop)
    }

    fn encoded(&self, path: &Path, format: &str, backdrop: Backdrop) -> Result<Vec<u8>> {
        let [w, h] = self.size.map(|n| n as usize);
        // Float files are encoded whole before they are written; of 8 bits there are the samples and what they pack to.
        let each = match format {
            "npy" => 16,
            "exr" => 32,
            _ => 8,
        };
        memory::check(&format!("a file of {w}x{h} pixels"), each * self.pixels.len() as u64)?;
        Ok(match format {
            "npy" => npy::encode(&[h, w, 4], self.pixels.as_flattened()),
            "exr" => self.exr().map_err(|e| Error::file(path, std::io::Error::other(e)))?,
            "png" => {
                let mut bytes = Vec::new();
                let (pixels, kind) = self.eight_bit(backdrop)?;
                PngEncoder::new(&mut bytes)
                    .write_image(&pixels, self.size[0], self.size[1], kind)
                    .map_err(|e| Error::file(path, std::io::Error::other(e)))?;
                bytes
            }
            _ => return Err(Error::unsupported(path, "the picture can be written as .png, .exr or .npy")),
        })
    }

    /// How far this picture is from `other`; none if their sizes differ.
    pub fn compare(&self, other: &Image) -> Option<Difference> {
        if self.size != other.size {
            return None;
        }
        let mut d = Difference { max: 0.0, rmse: 0.0, mean: 0.0, at: [0, 0] };
        for (i, (a, b)) in self.pixels.iter().zip(&other.pixels).enumerate() {
            for e in std::array::from_fn::<f64, 4, _>(|k| distance(a[k], b[k])) {
                if e > d.max {
                    let w = self.size[0] as usize;
                    (d.max, d.at) = (e, [(i % w) as u32, (i / w) as u32]);
                }
                d.mean += e;
                d.rmse += e * e;
            }
        }
        let n = (4 * self.pixels.len()).max(1) as f64;
        Some(Difference { rmse: (d.rmse / n).sqrt(), mean: d.mean / n, ..d })
    }

    /// An opaque picture of the absolute differences to `other` times `gain`, in [0, 1]; an opacity that differs where
    /// the colours do not shows grey. None if the sizes differ.
    pub fn difference(&self, other: &Image, gain: f32) -> Option<Image> {
        let show = |(a, b): (&[f32; 4], &[f32; 4])| {
            let e: [f32; 4] = std::array::from_fn(|k| (distance(a[k], b[k]) as f32 * gain).min(1.0));
            let colour = e[0].max(e[1]).max(e[2]);
            if colour > 0.0 { [e[0], e[1], e[2], 1.0] } else { [e[3], e[3], e[3], 1.0] }
        };
        let pixels = || self.pixels.iter().zip(&other.pixels).map(show).collect();
        (self.size == other.size).then(|| Image { size: self.size, pixels: pixels() })
    }

    /// The 8-bit samples of the picture over `backdrop`, and their layout.
    fn eight_bit(&self, backdrop: Backdrop) -> Result<(Vec<u8>, ExtendedColorType)> {
        let over = |p: &[f32; 4], b: &[f32; 3]| [0, 1, 2].map(|k| byte(p[k] + (1.0 - p[3]) * b[k]));
        let pixels = self.pixels.iter();
        Ok(match backdrop {
            Backdrop::Transparent => {
                let straight = |p: &[f32; 4]| {
                    let a = p[3];
                    let c = |k: usize| if a > 0.0 { byte(p[k] / a) } else { 0 };
                    [c(0), c(1), c(2), byte(a)]
                };
                (pixels.flat_map(straight).collect(), ExtendedColorType::Rgba8)
            }
            Backdrop::Color(b) => (pixels.flat_map(|p| over(p, &b)).collect(), ExtendedColorType::Rgb8),
            Backdrop::Pixels(b) if b.len() == self.pixels.len() => {
                (pixels.zip(b).flat_map(|(p, b)| over(p, b)).collect(), ExtendedColorType::Rgb8)
            }
            Backdrop::Pixels(b) => {
                let [w, h] = self.size;
                return Err(Error::View(format!("{} background colours for an image of {w}x{h} pixels", b.len())));
            }
        })
    }

    fn exr(&self) -> exr::error::Result<Vec<u8>> {
        let [w, h] = self.size.map(|n| n as usize);
        let channels = exr::prelude::SpecificChannels::rgba(|at: exr::prelude::Vec2<usize>| {
            let [r, g, b, a] = self.pixels[at.y() * w + at.x()];
            (r, g, b, a)
        });
        let mut bytes = std::io::Cursor::new(Vec::new());
        // Not parallel: exr would start threads of its own.
        exr::prelude::Image::from_channels((w, h), channels).write().non_parallel().to_buffered(&mut bytes)?;
        Ok(bytes.into_inner())
    }
}

fn read_exr(path: &Path) -> Result<Image> {
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    let empty = |size: exr::prelude::Vec2<usize>, _: &_| Image::new([size.width() as u32, size.height() as u32]);
    let set = |image: &mut Image, at: exr::prelude::Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
        image.pixels[at.y() * image.size[0] as usize + at.x()] = [r, g, b, a];
    };
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(empty, set)
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| Error::malformed(path, format!("not an RGBA OpenEXR file: {e}")))?;
    Ok(read.layer_data.channel_data.pixels)
}

/// The path's extension in small letters; empty if there is none.
fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// `v` in [0, 1] as a byte, rounded to nearest; NaN gives 0.
fn byte(v: f32) -> u8 {
    (v * 255.0).round() as u8
}

/// Absolute difference; equal infinities are 0 apart, and NaN is infinitely far from everything.
fn distance(a: f32, b: f32) -> f64 {
    let d = if a == b { 0.0 } else { (f64::from(a) - f64::from(b)).abs() };
    if d.is_nan() { f64::INFINITY } else { d }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Image {
        let pixels = vec![
            [0.0; 4],
            [0.25, 0.0, 0.5, 0.5],
            [1.0, 0.5, 0.0, 1.0],
            [1e-9, 3.0, 0.0, 0.1],
            [0.1; 4],
            [0.2, 0.1, 0.0, 0.3],
        ];
        Image { size: [3, 2], pixels }
    }

    #[test]
    fn float_files_keep_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.npy", "a.EXR"] {
            let path = folder.path().join(name);
            picture().save(&path, Backdrop::Transparent).unwrap();
            assert_eq!(Image::open(&path).unwrap(), picture());
        }
    }

    #[test]
    fn png_is_the_picture_over_its_backdrop() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let read = |backdrop| {
            picture().save(&path, backdrop).unwrap();
            ::image::open(&path).unwrap()
        };
        let straight = read(Backdrop::Transparent).into_rgba8();
        assert_eq!(straight.get_pixel(0, 0).0, [0, 0, 0, 0]);
        assert_eq!(straight.get_pixel(1, 0).0, [128, 0, 255, 128]);
        assert_eq!(straight.get_pixel(0, 1).0, [0, 255, 0, 26], "clamped");
        let over = read(Backdrop::Color([1.0, 0.5, 0.0]));
        assert_eq!(over.color(), ::image::ColorType::Rgb8);
        let over = over.into_rgb8();
        assert_eq!(over.get_pixel(0, 0).0, [255, 128, 0]);
        assert_eq!(over.get_pixel(1, 0).0, [191, 64, 128]);
        assert_eq!(over.get_pixel(2, 0).0, [255, 128, 0]);
        let mut colors = [[0.0; 3]; 6];
        colors[0] = [0.2, 0.4, 0.6];
        assert_eq!(read(Backdrop::Pixels(&colors)).into_rgb8().get_pixel(0, 0).0, [51, 102, 153]);
    }

    #[test]
    fn what_cannot_be_saved_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |name: &str, backdrop| {
            let path = folder.path().join(name);
            let message = picture().save(&path, backdrop).unwrap_err().to_string();
            assert!(!path.exists() && !message.contains('\n'), "{message}");
            message
        };
        assert!(refused("a.jpg", Backdrop::Transparent).contains(".png"));
        assert!(refused("nowhere/a.png", Backdrop::Transparent).contains("nowhere"));
        assert!(refused("a.png", Backdrop::Pixels(&[])).contains("3x2"));
    }

    #[test]
    fn differences_are_counted() {
        let (a, mut b) = (picture(), picture());
        assert_eq!(a.compare(&b).unwrap().max, 0.0);
        b.pixels[3][2] += 0.5;
        let d = a.compare(&b).unwrap();
        assert_eq!((d.max, d.at), (0.5, [0, 1]));
        assert!((d.rmse - 0.5 / 24_f64.sqrt()).abs() < 1e-12 && (d.mean - 0.5 / 24.0).abs() < 1e-12);
        assert_eq!(a.difference(&b, 8.0).unwrap().pixels[3], [0.0, 0.0, 1.0, 1.0]);
        b.pixels[0][3] = f32::NAN;
        let d = a.compare(&b).unwrap();
        assert_eq!((d.max, d.rmse, d.at), (f64::INFINITY, f64::INFINITY, [0, 0]));
        assert_eq!(a.compare(&Image::new([2, 3])), None);
    }
}
