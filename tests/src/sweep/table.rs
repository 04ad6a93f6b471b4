//! The measurements as comma-separated values, one line each.

use super::record::Record;

/// Names of the columns.
const COLUMNS: &str = "case,method,samples,order,encoding,directions,preset,steps,lights,backend,bytes,\
                       light_bytes,bytes_per_sample,bake_s,frame_ms_min,frame_ms_median,frame_ms_max,splats_per_ray,rel_rmse,\
                       psnr_db,bias,p99_rel,non_finite,reference_noise,adapter,note";

/// The whole table. What does not apply is empty.
pub fn csv(records: &[Record]) -> String {
    let mut text = format!("{COLUMNS}\n");
    for Record { key, outcome: o } in records {
        let number = |n: usize| if n == 0 { String::new() } else { n.to_string() };
        let word = |w: &str| if w == "-" { String::new() } else { quoted(w) };
        let fields = [
            quoted(&key.case),
            key.method.name().to_owned(),
            number(key.samples),
            number(key.order),
            word(&key.encoding),
            number(key.directions),
            word(&key.preset),
            number(key.steps),
            key.lights.to_string(),
            key.backend.clone(),
            o.bytes.to_string(),
            o.light_bytes.to_string(),
            if o.bytes_per_sample > 0.0 { format!("{:.1}", o.bytes_per_sample) } else { String::new() },
            format!("{:.3}", o.bake_s),
            format!("{:.3}", o.frame_ms[0]),
            format!("{:.3}", o.frame_ms[1]),
            format!("{:.3}", o.frame_ms[2]),
            if o.splats_per_ray > 0.0 { format!("{:.1}", o.splats_per_ray) } else { String::new() },
            format!("{:.6}", o.rel_rmse),
            o.psnr_db.map_or_else(String::new, |p| format!("{p:.3}")),
            format!("{:.6}", o.bias),
            format!("{:.6}", o.p99_rel),
            o.non_finite.to_string(),
            format!("{:.6}", o.reference_noise),
            quoted(&o.adapter),
            quoted(&o.note),
        ];
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    text
}

/// Quoted where the text would break a line into wrong fields.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::record::samples::record;

    #[test]
    fn every_line_has_every_field() {
        let mut odd = record(7);
        odd.key.case = "a,\"b\"".to_owned();
        let text = csv(&[record(5), odd]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert_eq!(lines[1].split(',').count(), COLUMNS.split(',').count());
        assert!(lines[1].starts_with("ball,splats,5,5,lobe,64,standard,,8,cpu,10,5,"), "{}", lines[1]);
        assert!(lines[2].starts_with("\"a,\"\"b\"\"\",splats,7,"), "{}", lines[2]);
    }
}
