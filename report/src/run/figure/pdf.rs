//! A picture as a PDF file of one page.
//!
//! The page has the shapes of the SVG picture, and its text as outlines of the bundled font: it
//! looks alike everywhere, and needs no font. Only the elements of the figures are translated:
//! paths in plain colours, dashes, opacity, and rectangles that clip.

use std::collections::BTreeSet;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Rect, Ref};
use resvg::tiny_skia::{PathSegment, Transform};
use resvg::usvg::{self, FillRule, Group, LineCap, LineJoin, Node, Paint, PaintOrder, Path, Tree};

/// Points of PDF in a millimetre.
const POINTS_PER_MM: f32 = 72.0 / 25.4;
/// Points of PDF in a pixel of SVG. An inch has 96 pixels.
const POINTS_PER_PX: f32 = 72.0 / 96.0;

/// Returns the bytes of a PDF file with the picture, which is `width_mm` wide, or as wide as the
/// picture says.
pub(super) fn pdf(tree: &Tree, width_mm: Option<f32>) -> Vec<u8> {
    let size = tree.size();
    let scale = width_mm.map_or(POINTS_PER_PX, |width_mm| width_mm * POINTS_PER_MM / size.width());
    let mut page = Page { content: Content::new(), opacities: BTreeSet::new() };
    // PDF counts upwards from the lower edge.
    page.content.transform([scale, 0.0, 0.0, -scale, 0.0, scale * size.height()]);
    page.group(tree.root(), 1.0);
    let Page { content, opacities } = page;
    let [catalog, pages, sheet, stream] = [1, 2, 3, 4].map(Ref::new);
    let mut file = Pdf::new();
    file.catalog(catalog).pages(pages);
    file.pages(pages).kids([sheet]).count(1);
    let mut written = file.page(sheet);
    written.parent(pages).contents(stream).media_box(Rect::new(0.0, 0.0, scale * size.width(), scale * size.height()));
    let mut resources = written.resources();
    let mut states = resources.ext_g_states();
    for opacity in opacities {
        let share = f32::from(opacity) / 255.0;
        states
            .insert(Name(&name(opacity)))
            .start::<pdf_writer::writers::ExtGraphicsState<'_>>()
            .non_stroking_alpha(share)
            .stroking_alpha(share);
    }
    states.finish();
    resources.finish();
    written.finish();
    file.stream(stream, &deflate(&content.finish())).filter(Filter::FlateDecode);
    file.finish()
}

/// Returns the name of the graphics state with this opacity.
fn name(opacity: u8) -> Vec<u8> {
    format!("a{opacity}").into_bytes()
}

/// Returns the compressed bytes.
fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// The page that is being drawn.
struct Page {
    content: Content,
    /// The opacities that shapes have, of 255.
    opacities: BTreeSet<u8>,
}

impl Page {
    /// Draws a group, whose opacity counts for each of its shapes.
    fn group(&mut self, group: &Group, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        self.content.save_state();
        self.transform(group.transform());
        if let Some(clip) = group.clip_path() {
            for node in clip.root().children() {
                if let Node::Path(path) = node {
                    self.outline(path);
                }
            }
            self.content.clip_nonzero().end_path();
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, opacity),
                Node::Path(path) => self.path(path, opacity),
                Node::Text(text) => self.group(text.flattened(), opacity),
                Node::Image(_) => {}
            }
        }
        self.content.restore_state();
    }

    fn transform(&mut self, Transform { sx, kx, ky, sy, tx, ty }: Transform) {
        self.content.transform([sx, ky, kx, sy, tx, ty]);
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        if !path.is_visible() {
            return;
        }
        let [first, second]: [fn(&mut Self, &Path, f32); 2] = match path.paint_order() {
            PaintOrder::FillAndStroke => [Self::fill, Self::stroke],
            PaintOrder::StrokeAndFill => [Self::stroke, Self::fill],
        };
        first(self, path, opacity);
        second(self, path, opacity);
    }

    fn fill(&mut self, path: &Path, opacity: f32) {
        let Some(fill) = path.fill() else { return };
        let Some([red, green, blue]) = self.colour(fill.paint(), opacity * fill.opacity().get()) else { return };
        self.content.set_fill_rgb(red, green, blue);
        self.outline(path);
        match fill.rule() {
            FillRule::NonZero => self.content.fill_nonzero(),
            FillRule::EvenOdd => self.content.fill_even_odd(),
        };
    }

    fn stroke(&mut self, path: &Path, opacity: f32) {
        let Some(stroke) = path.stroke() else { return };
        let Some([red, green, blue]) = self.colour(stroke.paint(), opacity * stroke.opacity().get()) else { return };
        self.content
            .set_stroke_rgb(red, green, blue)
            .set_line_width(stroke.width().get())
            .set_line_cap(match stroke.linecap() {
                LineCap::Butt => LineCapStyle::ButtCap,
                LineCap::Round => LineCapStyle::RoundCap,
                LineCap::Square => LineCapStyle::ProjectingSquareCap,
            })
            .set_line_join(match stroke.linejoin() {
                LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
                LineJoin::Round => LineJoinStyle::RoundJoin,
                LineJoin::Bevel => LineJoinStyle::BevelJoin,
            })
            .set_dash_pattern(stroke.dasharray().unwrap_or(&[]).iter().copied(), stroke.dashoffset());
        self.outline(path);
        self.content.stroke();
    }

    /// Sets the opacity, and returns the colour, or `None` if the paint is no plain colour.
    fn colour(&mut self, paint: &Paint, opacity: f32) -> Option<[f32; 3]> {
        let Paint::Color(usvg::Color { red, green, blue }) = paint else { return None };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
        let opacity = (255.0 * opacity).round() as u8;
        self.opacities.insert(opacity);
        self.content.set_parameters(Name(&name(opacity)));
        Some([*red, *green, *blue].map(|part| f32::from(part) / 255.0))
    }

    /// Appends the outline of a path.
    fn outline(&mut self, path: &Path) {
        let mut last = [0.0_f32; 2];
        for segment in path.data().segments() {
            match segment {
                PathSegment::MoveTo(to) => {
                    self.content.move_to(to.x, to.y);
                    last = [to.x, to.y];
                }
                PathSegment::LineTo(to) => {
                    self.content.line_to(to.x, to.y);
                    last = [to.x, to.y];
                }
                PathSegment::QuadTo(by, to) => {
                    // The cubic curve that is equal to the quadratic one.
                    let towards = |from: f32, by: f32| from + 2.0 / 3.0 * (by - from);
                    let first = [towards(last[0], by.x), towards(last[1], by.y)];
                    let second = [towards(to.x, by.x), towards(to.y, by.y)];
                    self.content.cubic_to(first[0], first[1], second[0], second[1], to.x, to.y);
                    last = [to.x, to.y];
                }
                PathSegment::CubicTo(a, b, to) => {
                    self.content.cubic_to(a.x, a.y, b.x, b.y, to.x, to.y);
                    last = [to.x, to.y];
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }
}
