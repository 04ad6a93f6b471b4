//! The schedule without rays: work that costs a fixed time a sample.

use super::*;

const SAMPLES: usize = 1000;
/// Milliseconds a sample: 1 ms for 500 of them.
const COST: f64 = 0.002;
const SETTINGS: Settings =
    Settings { milliseconds: 1.0, rest_frames: 3, fade_frames: 8, memory: 2 * 16 * SAMPLES as u64 };

/// Counts what it is asked for.
#[derive(Default)]
struct Fake {
    runs: Vec<(FrameLight, Range<usize>)>,
    compared: usize,
}

impl Work for Fake {
    fn samples(&self) -> usize {
        SAMPLES
    }

    fn run(&mut self, light: &FrameLight, range: Range<usize>) -> (Portion, f64) {
        self.runs.push((*light, range.clone()));
        let depths = range.clone().map(|i| [i as f32, 1.0]).collect();
        let squares = Squares { difference: range.len() as f64, exact: 100.0 * range.len() as f64 };
        let corrections = vec![[f16::ONE; 4]; range.len()];
        let milliseconds = range.len() as f64 * COST;
        (Portion { depths, corrections, squares }, milliseconds)
    }

    fn compare(
        &mut self,
        _: &FrameLight,
        range: Range<usize>,
        depths: &[[f32; 2]],
    ) -> (Vec<[f16; 4]>, Squares) {
        assert_eq!(depths.len(), range.len());
        self.compared += 1;
        (vec![[f16::ZERO; 4]; range.len()], Squares { difference: 0.0, exact: 1.0 })
    }
}

fn light(x: f32) -> FrameLight {
    FrameLight {
        kind: LightKind::Point,
        position: Vec3::new(x, 2.0, 0.0),
        direction: Vec3::NEG_Y,
        colour: Vec3::ONE,
        cos_inner: -1.0,
        cos_outer: -1.0,
        most_cosine: 1.0,
        exact: false,
    }
}

const REST: Wish = Wish::AtRest(1.0);

/// Shares of all lights after each of `frames` frames of the same lights.
fn shares(schedule: &mut Schedule, lights: &[FrameLight], wish: Wish, frames: usize) -> Vec<Vec<f32>> {
    let (mut work, wishes) = (Fake::default(), vec![wish; lights.len()]);
    let frame = |_| {
        let exact = schedule.advance(lights, &wishes, &mut work);
        (0..lights.len()).map(|i| exact.share(i)).collect()
    };
    (0..frames).map(frame).collect()
}

/// Frames until nothing changes any more.
fn settle(schedule: &mut Schedule, lights: &[FrameLight], wish: Wish) -> usize {
    (1..500)
        .find(|_| {
            shares(schedule, lights, wish, 1);
            !schedule.is_busy()
        })
        .unwrap()
}

#[test]
fn a_light_at_rest_is_traced_within_the_budget_and_fades_in() {
    let (mut schedule, mut work) = (Schedule::new(SETTINGS), Fake::default());
    let mut seen = Vec::new();
    for frame in 0..20 {
        let before = work.runs.len();
        let exact = schedule.advance(&[light(0.0)], &[REST], &mut work);
        let samples: usize = work.runs[before..].iter().map(|(_, r)| r.len()).sum();
        // One portion of the smallest size may exceed what is left of a frame's time.
        assert!(samples as f64 * COST <= SETTINGS.milliseconds + 64.0 * COST, "{frame}: {samples}");
        assert!(frame >= 3 || samples == 0, "it has not come to rest yet");
        assert!((schedule.report().milliseconds - samples as f64 * COST).abs() < 1e-9);
        seen.push(exact.share(0));
        let expected = match frame {
            0..3 => (0, 0, 1),
            3..4 => (0, 1, 0),
            4 => (0, 0, 1),
            5..12 => (0, 0, 0),
            _ => (1, 0, 0),
        };
        let report = schedule.report();
        let fading = usize::from((5..12).contains(&frame));
        assert_eq!((report.exact, report.waiting, report.baked), expected, "{frame}");
        assert_eq!((report.fading, schedule.is_busy()), (fading, frame < 12), "{frame}");
    }
    // Three frames at rest, two of 500 samples each, then eighths.
    let rising = (1..=8).map(|k| k as f32 / 8.0);
    let expected: Vec<f32> =
        std::iter::repeat_n(0.0, 5).chain(rising).chain(std::iter::repeat_n(1.0, 7)).collect();
    assert_eq!(seen, expected);
    assert_eq!(work.runs.iter().map(|(_, r)| r.len()).sum::<usize>(), SAMPLES);
    let exact = schedule.advance(&[light(0.0)], &[REST], &mut work);
    let depths = exact.light(0).unwrap();
    assert!(depths.iter().enumerate().all(|(i, d)| d[0] == i as f32), "portions are in order");
    assert_eq!(schedule.report().errors, [LightError { light: 0, relative: 0.1 }]);
}

#[test]
fn a_light_that_moves_fades_out_with_its_correction_and_comes_back() {
    let mut schedule = Schedule::new(SETTINGS);
    settle(&mut schedule, &[light(0.0)], REST);
    let mut work = Fake::default();
    let mut last = 1.0;
    for k in 1..=8 {
        let exact = schedule.advance(&[light(k as f32)], &[REST], &mut work);
        let share = exact.share(0);
        assert_eq!(share, last - 0.125);
        assert!(exact.light(0).is_none(), "depths of the old place do not serve");
        last = share;
    }
    assert_eq!(last, 0.0);
    assert!(work.runs.is_empty(), "nothing is traced for a light on its way");
    // Back in its old place the depths are known: no rays, and no wait.
    assert_eq!(shares(&mut schedule, &[light(0.0)], REST, 3), [[0.125], [0.25], [0.375]]);
    // Away and back before it was out: it turns round.
    assert_eq!(shares(&mut schedule, &[light(1.5)], REST, 1), [[0.25]]);
    assert_eq!(shares(&mut schedule, &[light(0.0)], REST, 2), [[0.375], [0.5]]);
}

#[test]
fn work_for_a_light_that_moves_is_dropped() {
    let (mut schedule, mut work) = (Schedule::new(SETTINGS), Fake::default());
    for _ in 0..4 {
        schedule.advance(&[light(0.0)], &[REST], &mut work);
    }
    assert_eq!(work.runs.iter().map(|(_, r)| r.len()).sum::<usize>(), 500);
    work.runs.clear();
    for _ in 0..12 {
        schedule.advance(&[light(1.0)], &[REST], &mut work);
    }
    let first = &work.runs[0];
    assert_eq!((first.0.position.x, first.1.start), (1.0, 0));
    assert_eq!(schedule.kept.bytes(), 16 * 1000);
}

#[test]
fn marked_lights_come_first_and_then_the_brightest() {
    let (mut schedule, mut work) = (Schedule::new(SETTINGS), Fake::default());
    let lights = [light(0.0), light(1.0), light(2.0)];
    let wishes = [Wish::AtRest(1.0), Wish::AtRest(5.0), Wish::Marked(0.1)];
    for _ in 0..12 {
        schedule.advance(&lights, &wishes, &mut work);
    }
    let mut order: Vec<f32> = work.runs.iter().map(|(l, _)| l.position.x).collect();
    order.dedup();
    // There is memory for two.
    assert_eq!(order, [2.0, 1.0]);
    assert_eq!((schedule.report().crowded, schedule.report().waiting), (1, 0));
}

#[test]
fn memory_is_bounded_and_the_least_recently_used_go_first() {
    let mut schedule = Schedule::new(SETTINGS);
    for x in [0.0, 1.0, 2.0] {
        settle(&mut schedule, &[light(x)], REST);
        assert!(schedule.report().bytes <= SETTINGS.memory);
    }
    assert_eq!(schedule.report().evicted, 1);
    let kept = |x: f32| schedule.kept.contains(&place(&light(x)));
    assert_eq!([0.0, 1.0, 2.0].map(kept), [false, true, true]);
    // More lights than there is memory for: two are exact, and the schedule rests.
    let lights = [3.0, 4.0, 5.0, 6.0].map(light);
    let mut schedule = Schedule::new(SETTINGS);
    settle(&mut schedule, &lights, REST);
    let report = schedule.report();
    assert_eq!((report.exact, report.crowded, report.baked), (2, 2, 0));
    assert_eq!(shares(&mut schedule, &lights, REST, 1), [[1.0, 1.0, 0.0, 0.0]]);
    // Less of it takes depths away that are in use: their lights fade back.
    schedule.set_memory(16 * 1000);
    let fading = shares(&mut schedule, &lights, REST, 1);
    assert!(
        schedule.report().bytes == 16 * 1000 && fading[0].iter().any(|s| *s > 0.0 && *s < 1.0),
        "{fading:?}"
    );
    settle(&mut schedule, &lights, REST);
    assert_eq!((schedule.report().exact, schedule.report().crowded), (1, 3));
    // Not even one fits.
    let mut none = Schedule::new(Settings { memory: 10, ..SETTINGS });
    settle(&mut none, &lights, REST);
    assert_eq!((none.report().crowded, none.report().bytes), (4, 0));
}

#[test]
fn lights_are_followed_when_others_are_removed_or_added() {
    let mut schedule = Schedule::new(Settings { memory: u64::MAX, ..SETTINGS });
    let lights = [0.0, 1.0, 2.0].map(light);
    settle(&mut schedule, &lights, REST);
    assert_eq!(shares(&mut schedule, &lights[1..], REST, 1), [[1.0, 1.0]]);
    let more = [lights[1], light(9.0), lights[2]];
    assert_eq!(shares(&mut schedule, &more, REST, 1), [[1.0, 0.0, 1.0]]);
    assert_eq!(shares(&mut schedule, &[], REST, 1), [[0.0; 0]]);
    assert!(!schedule.is_busy());
}

#[test]
fn lights_that_baked_depths_would_be_wrong_for_are_exact_at_once_and_while_they_move() {
    let (mut schedule, mut work) = (Schedule::new(SETTINGS), Fake::default());
    for k in 0..4 {
        let exact = schedule.advance(&[light(k as f32)], &[Wish::AtOnce], &mut work);
        assert_eq!(exact.share(0), 1.0);
        assert_eq!(work.runs.len(), k + 1);
    }
    schedule.advance(&[light(3.0)], &[Wish::AtOnce], &mut work);
    assert_eq!(work.runs.len(), 4);
    // One that was baked goes there in steps.
    let mut schedule = Schedule::new(SETTINGS);
    shares(&mut schedule, &[light(0.0)], Wish::Baked, 2);
    assert_eq!(shares(&mut schedule, &[light(0.0)], Wish::AtOnce, 2), [[0.125], [0.25]]);
}

#[test]
fn no_wish_and_no_time_need_no_rays() {
    let mut schedule = Schedule::new(SETTINGS);
    settle(&mut schedule, &[light(0.0)], REST);
    let expected: Vec<[f32; 1]> = (0..8).rev().map(|k| [k as f32 / 8.0]).collect();
    assert_eq!(shares(&mut schedule, &[light(0.0)], Wish::Baked, 8), expected);
    assert!(!schedule.is_busy());
    let (mut schedule, mut work) =
        (Schedule::new(Settings { milliseconds: 0.0, ..SETTINGS }), Fake::default());
    for _ in 0..20 {
        schedule.advance(&[light(0.0)], &[REST], &mut work);
    }
    assert!(work.runs.is_empty());
}

#[test]
fn corrections_follow_the_material_and_depths_need_not() {
    let mut schedule = Schedule::new(SETTINGS);
    settle(&mut schedule, &[light(0.0)], REST);
    schedule.change_material();
    let mut work = Fake::default();
    let exact = schedule.advance(&[light(0.0)], &[REST], &mut work);
    assert_eq!((exact.share(0), work.compared, work.runs.len()), (1.0, 0, 0));
    // When they fade out it is by how far the new material is from them, found once.
    for k in 1..4 {
        let exact = schedule.advance(&[light(k as f32)], &[REST], &mut work);
        let Some(Known::Corrected { by, .. }) = exact.known(0) else { panic!("not on its way") };
        assert!(by.values().iter().all(|d| d[0] == f16::ZERO));
    }
    assert_eq!(work.compared, 1);
}
