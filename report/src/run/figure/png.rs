//! From an SVG's text to pixels, with the bundled font alone.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

use super::svg::FONT;

/// DejaVu Sans, cut down to the characters that figures use; its licence lies beside it.
const FONT_FILE: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");
/// Pixels for each unit of the picture: sharp enough for print at half a page's width.
const SCALE: f32 = 2.0;

/// A picture that could not be turned into pixels.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The text is no picture.
    #[error("failed to read the picture: {0}")]
    Svg(#[from] resvg::usvg::Error),
    /// The picture has no area, or too large a one.
    #[error("failed to draw a picture of {width} by {height} pixels")]
    Size {
        /// Its width [px].
        width: u32,
        /// Its height [px].
        height: u32,
    },
    /// The pixels could not be packed.
    #[error("failed to encode the picture: {reason}")]
    Encode {
        /// The library's reason.
        reason: String,
    },
}

/// The bytes of a PNG file that shows an SVG picture.
///
/// # Errors
/// [`PngError`] where the text is no picture, or it cannot be drawn.
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
