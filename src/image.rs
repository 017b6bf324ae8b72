//! The picture: linear premultiplied RGBA in 32-bit floats.

/// A picture. Row 0 is the top; the background is not in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Premultiplied linear red, green, blue and opacity of each pixel, row by row.
    pub pixels: Vec<[f32; 4]>,
}

impl Image {
    /// An empty (transparent) picture of `size` pixels.
    pub fn new(size: [u32; 2]) -> Self {
        Image { size, pixels: vec![[0.0; 4]; size[0] as usize * size[1] as usize] }
    }
}
