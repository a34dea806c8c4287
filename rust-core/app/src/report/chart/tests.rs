use super::*;

fn line(points: Vec<(f64, f64)>, style: Style) -> Series {
    Series { name: "a < b".into(), color: "#123456", style, points, in_legend: true, marks_peak: true }
}

fn chart(series: Vec<Series>) -> Chart {
    Chart {
        id: "test".into(),
        title: "A & B".into(),
        x: Axis::new("strain, ‰"),
        y: Axis::new("stress, MPa"),
        series,
        legend: true,
        ..Chart::default()
    }
}

#[test]
fn ticks_are_round_and_within_the_scale() {
    let labels = |values: [f64; 2], logarithmic| {
        let scale = Scale::new(values.into_iter(), logarithmic, 0.0, 100.0).unwrap();
        scale.ticks().into_iter().map(|(_, label)| label).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(labels([0.0, 0.7], false), "0 0.1 0.2 0.3 0.4 0.5 0.6 0.7");
    assert_eq!(labels([-32.0, 0.0], false), "−30 −25 −20 −15 −10 −5 0");
    assert_eq!(labels([0.0, 3e7], false), "0 1·10⁷ 2·10⁷ 3·10⁷");
    assert_eq!(labels([1e-6, 4e-6], false), "1·10⁻⁶ 2·10⁻⁶ 3·10⁻⁶ 4·10⁻⁶");
    assert_eq!(labels([1e4, 1e9], true), "10⁴ 10⁵ 10⁶ 10⁷ 10⁸ 10⁹");
    assert_eq!(labels([0.1, 2.0], true), "0.1 0.2 0.5 1 2");
    // A single value gets a range, too.
    assert!(labels([5.0, 5.0], false).contains('5'));
    assert_eq!(Scale::new([f64::NAN].into_iter(), false, 0.0, 1.0), None);
}

#[test]
fn positions_are_linear_or_logarithmic() {
    let linear = Scale::new([0.0, 10.0].into_iter(), false, 0.0, 104.0).unwrap();
    // The scale is padded by 4 % at the end that is not zero; the tolerance is a few roundings.
    assert!((linear.place(5.0) - 50.0).abs() < 1e-12 && linear.place(0.0) == 0.0);
    let logarithmic = Scale::new([1.0, 100.0].into_iter(), true, 0.0, 108.0).unwrap();
    assert!((logarithmic.place(10.0) - 54.0).abs() < 1e-12);
}

/// Simplification keeps corners, omits points on a straight line, and no point is farther from the new line than the
/// tolerance.
#[test]
fn lines_are_simplified_within_the_tolerance() {
    let straight: Vec<(f64, f64)> = (0..=1000).map(|k| (f64::from(k), 2.0 * f64::from(k.min(500)))).collect();
    assert_eq!(simplified(&straight), [(0.0, 0.0), (500.0, 1000.0), (1000.0, 1000.0)]);
    let wave: Vec<(f64, f64)> = (0..=2000).map(|k| (f64::from(k) * 0.2, 100.0 * (f64::from(k) * 0.01).sin())).collect();
    let kept = simplified(&wave);
    assert!(kept.len() < 200, "{}", kept.len());
    for point in &wave {
        let nearest = kept.windows(2).map(|pair| distance(*point, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
        assert!(nearest <= TOLERANCE, "{point:?} is {nearest} away");
    }
    assert_eq!(simplified(&wave[..2]), wave[..2]);
}

#[test]
fn charts_have_names_ranges_and_peaks_in_words() {
    let points = vec![(0.0, 0.0), (0.1, 3.5), (f64::NAN, 1.0), (0.2, 1.0), (0.3, 0.5)];
    let html = chart(vec![line(points, Style::Line)]).html();
    for expected in [
        "role=\"img\" aria-labelledby=\"test-title test-desc\"",
        "<title id=\"test-title\">A &amp; B</title>",
        "a &lt; b: 0 to 0.3000, values 0 to 3.500, largest magnitude 3.500 at 0.1000.",
        "<ul class=\"legend\"><li>",
        ">3.500</text>",
    ] {
        assert!(html.contains(expected), "no {expected} in {html}");
    }
    // The line has a gap where a value is missing.
    assert_eq!(html.matches("<polyline data-name").count(), 2);
    assert!(!html.contains("NaN"), "{html}");
    assert!(chart(vec![line(vec![(f64::NAN, 0.0)], Style::Line)]).html().contains("no finite values"));
}

/// The second area lies between the first one's upper edge and the sum of both.
#[test]
fn areas_are_stacked() {
    let areas = [1.0, 2.0].map(|y| line(vec![(0.0, y), (1.0, y)], Style::StackedArea));
    let chart = chart(areas.to_vec());
    assert_eq!(chart.tops(), [vec![(0.0, 1.0), (1.0, 1.0)], vec![(0.0, 3.0), (1.0, 3.0)]]);
    let html = chart.html();
    assert_eq!(html.matches("<polygon").count(), 2);
    assert_eq!(html.matches("data-stacked").count(), 2);
}

/// The values of peaks that lie close together stay readable.
#[test]
fn values_of_peaks_do_not_overlap() {
    let curve = |at: f64, peak: f64| line(vec![(0.0, 0.0), (at, peak), (1.0, 0.5)], Style::Line);
    let html = chart((0..4).map(|k| curve(0.3 + 0.01 * f64::from(k), 5.0 + 0.05 * f64::from(k))).collect()).html();
    let attribute = |text: &str, name: &str| {
        let from = text.find(&format!(" {name}=\"")).expect("an attribute") + name.len() + 3;
        text[from..].split('"').next().expect("a value").to_owned()
    };
    let texts: Vec<(f64, f64, bool)> = html
        .split("<text class=\"halo\"")
        .skip(1)
        .map(|text| {
            let number = |name| attribute(text, name).parse::<f64>().expect("a number");
            (number("x"), number("y"), attribute(text, "text-anchor") == "end")
        })
        .collect();
    assert_eq!(texts.len(), 4);
    for (k, a) in texts.iter().enumerate() {
        for b in &texts[..k] {
            assert!(a.2 != b.2 || (a.1 - b.1).abs() >= 14.0, "{a:?} {b:?}");
        }
    }
}
