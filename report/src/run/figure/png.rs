//! Rendering of an SVG picture as PNG, with the bundled font only.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

use super::svg::FONT;

/// A subset of DejaVu Sans with the characters that the figures use. Its licence is in the same folder.
const FONT_FILE: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");
/// Pixels per unit of the SVG: enough for sharp print at half a page's width.
const SCALE: f32 = 2.0;

/// The reason why a picture cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The text is not valid SVG.
    #[error("failed to read the picture: {0}")]
    Svg(#[from] resvg::usvg::Error),
    /// The area of the picture is zero or too large.
    #[error("failed to draw a picture of {width} by {height} pixels")]
    Size {
        /// Width (px).
        width: u32,
        /// Height (px).
        height: u32,
    },
    /// The pixels cannot be encoded as PNG.
    #[error("failed to encode the picture: {reason}")]
    Encode {
        /// The reason that the PNG library gives.
        reason: String,
    },
}

/// Renders an SVG picture and returns the bytes of a PNG file.
///
/// # Errors
/// [`PngError`] if the text is not valid SVG, or the picture cannot be rendered.
pub fn png(svg: &str) -> Result<Vec<u8>, PngError> {
    let mut fonts = Database::new();
    fonts.load_font_data(FONT_FILE.to_vec());
    fonts.set_sans_serif_family(FONT);
    let options = Options { fontdb: Arc::new(fonts), font_family: FONT.to_owned(), ..Options::default() };
    let tree = Tree::from_str(svg, &options)?;
    let size = tree.size().to_int_size().scale_by(SCALE).ok_or(PngError::Size { width: 0, height: 0 })?;
    let (width, height) = (size.width(), size.height());
    let mut pixels = Pixmap::new(width, height).ok_or(PngError::Size { width, height })?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| PngError::Encode { reason: error.to_string() })
}
