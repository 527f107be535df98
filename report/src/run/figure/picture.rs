//! Pictures as files: SVG as it is, PNG and PDF with the bundled font only.

use std::path::PathBuf;
use std::sync::Arc;

use closecall_traffic::atomic::{WriteError, write_file};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

use super::pdf::pdf;
use super::svg::FONT;

/// A subset of DejaVu Sans with the characters that the figures use. Its licence is in the same
/// folder.
const FONT_FILE: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");
/// Pixels per unit of the SVG: enough for sharp print at half a page's width.
const SCALE: f32 = 2.0;
/// Pixels per millimetre of a picture whose width is given: 300 per inch.
const PIXELS_PER_MM: f32 = 300.0 / 25.4;
/// Smallest and largest width of a picture (mm): a narrower one has no legible letter, a wider one
/// fits on no sheet.
const WIDTHS_MM: [f32; 2] = [50.0, 1_200.0];

/// The reason why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
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
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// The formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Svg,
    Png,
    Pdf,
}

/// A file for a picture, whose extension determines the format.
#[derive(Clone, Debug)]
pub struct PictureFile {
    path: PathBuf,
    format: Format,
}

impl PictureFile {
    /// Returns the file of this path.
    ///
    /// # Errors
    /// A message if the path has no extension of a picture.
    pub fn parse(path: &str) -> Result<Self, String> {
        let path = PathBuf::from(path);
        let format = match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Format::Svg,
            Some("png") => Format::Png,
            Some("pdf") => Format::Pdf,
            _ => return Err(format!("`{}` must end with .svg, .png or .pdf", path.display())),
        };
        Ok(Self { path, format })
    }

    /// Returns the path.
    pub fn path(&self) -> &std::path::Path {
        &self.path
    }

    /// Writes an SVG picture that is `width_mm` wide, or as wide as it says. A PNG file of a given
    /// width has 300 pixels per inch.
    ///
    /// # Errors
    /// [`PictureError`] if the text is not valid SVG, or the picture cannot be rendered or written.
    pub fn write(&self, svg: &str, width_mm: Option<f32>) -> Result<(), PictureError> {
        let bytes = match self.format {
            Format::Svg => width_mm.map_or(Ok(svg.to_owned()), |width_mm| resized(svg, width_mm))?.into_bytes(),
            Format::Png => png(svg, width_mm)?,
            Format::Pdf => pdf(&tree(svg)?, width_mm),
        };
        Ok(write_file(&self.path, |file| file.write_all(&bytes))?)
    }
}

/// Parses the width of a picture (mm).
///
/// # Errors
/// A message if the text is not a number, or not within these widths.
pub fn parse_width_mm(text: &str) -> Result<f32, String> {
    let [least, most] = WIDTHS_MM;
    match text.parse::<f32>() {
        Ok(width_mm) if width_mm >= least && width_mm <= most => Ok(width_mm),
        _ => Err(format!("`{text}` is not a number from {least} to {most}")),
    }
}

/// Renders an SVG picture and returns the bytes of a PNG file.
pub(super) fn png(svg: &str, width_mm: Option<f32>) -> Result<Vec<u8>, PictureError> {
    let tree = tree(svg)?;
    let scale = width_mm.map_or(SCALE, |width_mm| width_mm * PIXELS_PER_MM / tree.size().width());
    let size = tree.size().to_int_size().scale_by(scale).ok_or(PictureError::Size { width: 0, height: 0 })?;
    let (width, height) = (size.width(), size.height());
    let mut pixels = Pixmap::new(width, height).ok_or(PictureError::Size { width, height })?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| PictureError::Encode { reason: error.to_string() })
}

/// Returns the shapes of an SVG picture.
fn tree(svg: &str) -> Result<Tree, PictureError> {
    let mut fonts = Database::new();
    fonts.load_font_data(FONT_FILE.to_vec());
    fonts.set_sans_serif_family(FONT);
    let options = Options { fontdb: Arc::new(fonts), font_family: FONT.to_owned(), ..Options::default() };
    Ok(Tree::from_str(svg, &options)?)
}

/// Returns an SVG picture with another size on paper.
fn resized(svg: &str, width_mm: f32) -> Result<String, PictureError> {
    let size = tree(svg)?.size();
    let height_mm = width_mm * size.height() / size.width();
    let written_size = format!("width=\"{}\" height=\"{}\"", size.width(), size.height());
    Ok(svg.replacen(&written_size, &format!("width=\"{width_mm}mm\" height=\"{height_mm:.2}mm\""), 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60\" height=\"20\">\
                       <text x=\"2\" y=\"15\" font-size=\"14\" font-family=\"'DejaVu Sans', sans-serif\">ΔV 9.8</text></svg>";

    #[test]
    fn a_picture_renders_its_text_and_gives_the_same_bytes_each_time() {
        let empty = SVG.replace("ΔV 9.8", "");
        for bytes in [|svg: &str| png(svg, None).unwrap(), |svg: &str| pdf(&tree(svg).unwrap(), None)] {
            assert_eq!(bytes(SVG), bytes(SVG));
            assert!(bytes(SVG).len() > bytes(&empty).len() + 100);
        }
    }

    #[test]
    fn a_width_changes_the_size_on_paper() {
        assert!(resized(SVG, 90.0).unwrap().contains("width=\"90mm\" height=\"30.00mm\""));
        let page = String::from_utf8_lossy(&pdf(&tree(SVG).unwrap(), Some(254.0))).into_owned();
        assert!(page.contains("/MediaBox [0 0 720 240]"), "{page}");
        // 90 mm at 300 pixels per inch; the width stands at byte 16 of a PNG file.
        let bytes = png(SVG, Some(90.0)).unwrap();
        let width = u32::from_be_bytes([bytes[16], bytes[17], bytes[18], bytes[19]]);
        assert!((1062..=1064).contains(&width), "{width}");
    }

    #[test]
    fn what_is_no_picture_and_no_width_is_refused() {
        assert!(png("no picture", None).is_err());
        assert!(PictureFile::parse("figure.jpg").unwrap_err().contains(".svg, .png or .pdf"));
        for text in ["nan", "inf", "-90", "0", "10", "wide"] {
            assert!(parse_width_mm(text).unwrap_err().contains("from 50 to 1200"), "{text}");
        }
    }
}
