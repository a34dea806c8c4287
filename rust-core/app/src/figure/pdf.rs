//! Figures as PDF of one page, whose text is text.

use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Finish, Name, Pdf as Writer, Rect, Ref, Str};

use super::TEXT;
use super::canvas::{Anchor, Canvas, Ink, Place};
use super::letters::{encoded, width_of};

const FONT: Name<'_> = Name(b"F1");
const SHARED: Name<'_> = Name(b"G1");

/// A drawing.
pub(super) struct Pdf {
    size: [f64; 2],
    content: Content,
    /// Share of the paper that areas cover, the same for all.
    share: f64,
}

impl Pdf {
    pub(super) fn new(size: [f64; 2]) -> Self {
        Self { size, content: Content::new(), share: 1.0 }
    }

    pub(super) fn finish(self) -> Vec<u8> {
        let [catalog, tree, page, font, content, state] = [1, 2, 3, 4, 5, 6].map(Ref::new);
        let mut writer = Writer::new();
        writer.catalog(catalog).pages(tree);
        writer.pages(tree).kids([page]).count(1);
        let mut one = writer.page(page);
        one.media_box(Rect::new(0.0, 0.0, self.size[0] as f32, self.size[1] as f32)).parent(tree).contents(content);
        let mut resources = one.resources();
        resources.fonts().pair(FONT, font);
        resources.ext_g_states().pair(SHARED, state);
        resources.finish();
        one.finish();
        writer.type1_font(font).base_font(Name(b"Helvetica")).encoding_predefined(Name(b"WinAnsiEncoding"));
        writer.ext_graphics(state).non_stroking_alpha(self.share as f32);
        writer.stream(content, &self.content.finish());
        writer.finish()
    }

    /// Coordinates count from the lower left.
    fn at(&self, (x, y): Place) -> (f32, f32) {
        (x as f32, (self.size[1] - y) as f32)
    }

    fn path(&mut self, places: &[Place]) {
        for (k, place) in places.iter().enumerate() {
            let (x, y) = self.at(*place);
            if k == 0 {
                self.content.move_to(x, y);
            } else {
                self.content.line_to(x, y);
            }
        }
    }
}

fn parts(ink: Ink) -> [f32; 3] {
    ink.map(|part| f32::from(part) / 255.0)
}

impl Canvas for Pdf {
    fn line(&mut self, places: &[Place], ink: Ink, width: f64, dash: &[f64]) {
        let [red, green, blue] = parts(ink);
        self.content.set_stroke_rgb(red, green, blue);
        self.content.set_line_width(width as f32);
        self.content.set_line_join(LineJoinStyle::RoundJoin);
        self.content.set_dash_pattern(dash.iter().map(|length| *length as f32), 0.0);
        self.path(places);
        self.content.stroke();
    }

    fn area(&mut self, outline: &[Place], ink: Ink, share: f64) {
        self.share = share;
        let [red, green, blue] = parts(ink);
        self.content.save_state();
        self.content.set_parameters(SHARED);
        self.content.set_fill_rgb(red, green, blue);
        self.path(outline);
        self.content.fill_nonzero();
        self.content.restore_state();
    }

    fn text(&mut self, place: Place, anchor: Anchor, is_upright: bool, text: &str) {
        let before = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5,
            Anchor::End => 1.0,
        } * width_of(text, TEXT);
        let start = if is_upright { (place.0, place.1 + before) } else { (place.0 - before, place.1) };
        let (x, y) = self.at(start);
        self.content.begin_text();
        self.content.set_font(FONT, TEXT as f32);
        let turned = if is_upright { [0.0, 1.0, -1.0, 0.0, x, y] } else { [1.0, 0.0, 0.0, 1.0, x, y] };
        self.content.set_text_matrix(turned);
        self.content.show(Str(&encoded(text)));
        self.content.end_text();
    }
}
