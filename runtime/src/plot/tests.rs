use super::{Chart, Joined, Panel, Point, Series, Unit, render};

fn chart() -> Chart {
    let point = |x: f64, y: f64, front: bool| Point {
        x,
        y,
        tip: "1 < 2 & \"three\"\u{7}".to_owned(),
        mark: "<8>".to_owned(),
        front,
    };
    let series = |style: usize, joined: Joined| Series {
        name: format!("kind & {style}"),
        style,
        joined,
        points: vec![point(1.0, 0.5, false), point(3.0, 0.1, true), point(0.0, f64::NAN, false)],
    };
    let panel = |title: &str| Panel {
        title: title.to_owned(),
        series: (0..4).map(|i| series(i, if i == 0 { Joined::No } else { Joined::Line })).collect(),
    };
    Chart {
        title: "a < b".to_owned(),
        subtitle: "\"quoted\" & more".to_owned(),
        x: ("time".to_owned(), Unit::Milliseconds),
        y: ("error".to_owned(), Unit::Percent),
        panels: vec![panel("one"), panel("two"), panel("three"), panel("four")],
    }
}

/// Checks that tags nest and close, attributes are quoted, and text holds no bare markup; returns the tags' names.
fn check_xml(text: &str) -> Vec<String> {
    let mut open: Vec<String> = Vec::new();
    let mut names = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let between = &rest[..start];
        assert!(!between.contains('>'), "bare > in {between}");
        for (i, _) in between.match_indices('&') {
            let entities = ["&amp;", "&lt;", "&gt;", "&quot;"];
            assert!(entities.iter().any(|e| between[i..].starts_with(e)), "bare & in {between}");
        }
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "closes another tag");
            continue;
        }
        assert!(!tag.contains('<') && !tag.contains('&'), "{tag}");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        assert_eq!(tag.matches("=\"").count() * 2, tag.matches('"').count(), "{tag}");
        let name = tag.trim_end_matches('/').split_whitespace().next().unwrap().to_owned();
        names.push(name.clone());
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "{open:?}");
    names
}

#[test]
fn the_file_is_well_formed_and_complete() {
    let text = render(&chart());
    let names = check_xml(&text);
    assert_eq!(names[0], "svg");
    let count = |n: &str| names.iter().filter(|m| *m == n).count();
    // Two usable points of three in each of four panels, and the legend: style 0 is a disk, the others polygons.
    assert_eq!(count("polygon"), 4 * 3 * 2 + 3);
    // Disks, rings around the front (four series each), and both in the legend.
    assert_eq!(count("circle"), 4 * 2 + 4 * 4 + 1 + 1);
    assert!(!text.contains("NaN") && !text.contains("inf"));
}

#[test]
fn nothing_to_draw_is_still_a_chart() {
    check_xml(&render(&Chart { panels: vec![], ..chart() }));
    let empty = Panel { title: String::new(), series: vec![] };
    check_xml(&render(&Chart { panels: vec![empty], ..chart() }));
}
