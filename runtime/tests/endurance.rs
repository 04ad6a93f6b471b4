//! A thousand frames on the CPU with changing lights, cameras, sizes, materials and assets: memory stays. What is allocated is
//! counted, not what the system lends the allocator: that comes and goes by one of its chunks, a seventh of the whole.

#[path = "gpu/objects.rs"]
#[expect(dead_code, reason = "shared with the tests of the GPU")]
mod objects;

use diaphane_formats::scene::{Camera, Light};
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::framing::default_scene;
use diaphane_runtime::player::{Backend, LightMode, Player};
use glam::DVec3;
use objects::{Object, ball, torus};
use peak_alloc::PeakAlloc;

const FRAMES: usize = 1000;
/// Frames after which each half of the rest is looked at: the first ones fill what is kept for later ones.
const WARM: usize = 300;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

#[test]
fn a_thousand_frames_take_the_memory_of_a_few() {
    let assets = [
        Object { spacing: 0.25, ..ball() }.build(),
        Object { spacing: 0.12, ..torus() }.build(),
        Object { spacing: 0.25, ior: 1.3, ..ball() }.build(),
    ];
    let mut most = [0.0f64; 2];
    let mut player = None;
    for k in 0..FRAMES {
        let asset = &assets[k / 50 % 3];
        if k % 50 == 0 {
            // The old one goes first, as in a window that shows another asset.
            drop(player.take());
        }
        let player = player.get_or_insert_with(|| Player::new(asset, Backend::Cpu).unwrap());
        let mut scene = default_scene(&asset.info);
        let centre = DVec3::from(asset.info.centre);
        let turn = 0.05 * k as f64;
        let position = centre + DVec3::new(3.0 * turn.sin(), 0.5, 3.0 * turn.cos());
        scene.camera = Camera { position, target: centre, ..scene.camera };
        (scene.image.width, scene.image.height) = (16 + 4 * (k as u32 / 10 % 4), 16);
        scene.image.samples_per_pixel = 1;
        // More than 32 directional lights are folded.
        scene.lights.extend((0..k % 40).map(|i| Light::Directional {
            direction: DVec3::new((i as f64).sin(), -1.0, (i as f64).cos()).normalize(),
            irradiance: DVec3::splat(0.05),
        }));
        let scale = [1.0, 0.7, 1.5][k / 7 % 3];
        player.edit(&Edit { extinction_scale: DVec3::splat(scale), albedo: None }).unwrap();
        player.set_reuse(k / 25 % 2 == 0);
        let mode = if k % 5 == 0 { LightMode::Exact } else { LightMode::Baked };
        let frame = Frame::new(&scene, &asset.info).unwrap();
        let rendered = player.render(&frame, mode).unwrap();
        assert!(rendered.counters.rays_hit > 0, "frame {k} shows nothing");
        if k >= WARM {
            let half = usize::from(k >= WARM.midpoint(FRAMES));
            most[half] = most[half].max(MEMORY.current_usage() as f64);
        }
    }
    let growth = most[1] / most[0] - 1.0;
    println!("from {:.1} MB by {:.2} %", most[0] / 1e6, 100.0 * growth);
    assert!(growth <= 0.02, "from {:.1} MB by {:.2} %", most[0] / 1e6, 100.0 * growth);
}
