//! Figures as SVG.

use std::fmt::Write as _;

use super::TEXT;
use super::canvas::{Anchor, Canvas, Ink, Place};
use crate::report::escape;

/// A drawing.
pub(super) struct Svg(String);

impl Svg {
    pub(super) fn new([width, height]: [f64; 2]) -> Self {
        Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{TEXT}\" fill=\"#1f262d\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        ))
    }

    pub(super) fn finish(self) -> String {
        self.0 + "</svg>\n"
    }
}

fn color([red, green, blue]: Ink) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn list(places: &[Place]) -> String {
    places.iter().map(|(x, y)| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

impl Canvas for Svg {
    fn line(&mut self, places: &[Place], ink: Ink, width: f64, dash: &[f64]) {
        let dash = match dash {
            [] => String::new(),
            dash => {
                let lengths: Vec<String> = dash.iter().map(ToString::to_string).collect();
                format!(" stroke-dasharray=\"{}\"", lengths.join(" "))
            }
        };
        let _ = writeln!(
            self.0,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>",
            list(places),
            color(ink)
        );
    }

    fn area(&mut self, outline: &[Place], ink: Ink, share: f64) {
        let (points, color) = (list(outline), color(ink));
        let _ = writeln!(self.0, "<polygon points=\"{points}\" fill=\"{color}\" fill-opacity=\"{share}\"/>");
    }

    fn text(&mut self, (x, y): Place, anchor: Anchor, is_upright: bool, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let turn = if is_upright { " rotate(-90)" } else { "" };
        let text = escape(text);
        let _ = writeln!(
            self.0,
            "<text transform=\"translate({x:.2} {y:.2}){turn}\" text-anchor=\"{anchor}\">{text}</text>"
        );
    }
}
