//! The HTML page: one section for each case, pictures embedded, nothing loaded from elsewhere.

use super::{Case, base64};
use diaphane_formats::Result;
use diaphane_formats::picture::{Display, Picture, encode_png};
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;\
background:#161616;color:#ddd}h1{font-size:1.5em}h2{font-size:1.2em;margin-top:2em}figure{display:inline-block;\
margin:0 12px 12px 0;vertical-align:top}img{height:340px;image-rendering:pixelated;display:block;background:#000}\
figcaption{font-size:.85em;color:#aaa}table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em 1.2em .15em 0;\
text-align:left;font-variant-numeric:tabular-nums}th{font-weight:600;color:#aaa}.warning{color:#fb6}";

/// The whole page as text.
///
/// # Errors
/// A picture cannot be encoded.
pub fn page(heading: &str, cases: &[Case]) -> Result<String> {
    let mut html = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n<p>Left: the baked asset as the player draws it. Middle: \
         the ray-marched reference at the same exposure. Right: where the player is too bright (red) or too dark \
         (blue), in units of the reference's root mean square. The figures are taken over the pixels that the mesh \
         covers fully, on linear radiance.</p>\n",
        escape(heading)
    );
    if cases.len() > 1 {
        overview(&mut html, cases);
    }
    for case in cases {
        section(&mut html, case)?;
    }
    html.push_str("</body></html>\n");
    Ok(html)
}

fn overview(html: &mut String, cases: &[Case]) {
    html.push_str(
        "<table><tr><th>object</th><th>rel. RMSE</th><th>PSNR</th><th>bias</th><th>frame</th></tr>\n",
    );
    for c in cases {
        let m = &c.metrics;
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{:.2} %</td><td>{:.1} dB</td><td>{:+.2} %</td><td>{:.0} ms</td></tr>",
            escape(&c.title),
            100.0 * m.rel_rmse,
            m.psnr_db,
            100.0 * m.bias,
            c.played.frame_ms
        );
    }
    html.push_str("</table>\n");
}

fn section(html: &mut String, case: &Case) -> Result<()> {
    let display = case.display();
    let map = case.error_map();
    let m = &case.metrics;
    let _ = writeln!(html, "<h2>{}</h2>", escape(&case.title));
    let error = encode_png(map.width, map.height, &map.rgb)?;
    for (name, png) in [
        ("player", png(&case.played.picture, display)?),
        ("reference", png(&case.reference.picture, display)?),
        ("error", error),
    ] {
        let _ = writeln!(
            html,
            "<figure><img alt=\"{name}\" src=\"data:image/png;base64,{}\"><figcaption>{name}</figcaption></figure>",
            base64::encode(&png)
        );
    }
    html.push_str("<table>\n");
    let mut row = |name: &str, value: &str| {
        let _ = writeln!(html, "<tr><th>{}</th><td>{}</td></tr>", escape(name), escape(value));
    };
    row("relative RMSE", &format!("{:.3} %", 100.0 * m.rel_rmse));
    row("PSNR", &format!("{:.2} dB", m.psnr_db));
    row("bias", &format!("{:+.3} %", 100.0 * m.bias));
    row("99th percentile of the relative error", &format!("{:.2} %", 100.0 * m.p99_rel));
    row("values that are not finite", &m.non_finite.to_string());
    row("pixels compared", &m.pixels.to_string());
    row("noise of the reference", &format!("{:.2} %", 100.0 * case.reference.error));
    row(
        "frame",
        &format!("{:.1} ms on {} ({})", case.played.frame_ms, case.played.backend, case.played.adapter),
    );
    row("kernels on a ray", &format!("{:.1}", case.played.splats_per_ray));
    for (name, value) in &case.facts {
        row(name, value);
    }
    html.push_str("</table>\n");
    for warning in &case.played.warnings {
        let _ = writeln!(html, "<p class=\"warning\">{}</p>", escape(warning));
    }
    Ok(())
}

fn png(picture: &Picture, display: Display) -> Result<Vec<u8>> {
    let rgb: Vec<u8> = picture.pixels.iter().flat_map(|p| display.encode(*p)).collect();
    encode_png(picture.width, picture.height, &rgb)
}

/// Text that is safe between tags and in attributes.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
