//! The side panel: what it shows of a session and what it changes in it.

use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::edit::Edit;
use diaphane_runtime::exact::ExactReport;
use diaphane_runtime::gpu::Statistics;
use diaphane_runtime::player::LightMode;
use egui::{CollapsingHeader, DragValue, Grid, RichText, Slider, SliderClamping, Ui};
use glam::DVec3;

/// Factors on the extinction that sliders offer.
const SCALES: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// Points across.
pub const WIDTH: f32 = 300.0;

/// What the panel works on.
pub struct Contents<'a> {
    pub scene: &'a mut Scene,
    pub fov_degrees: &'a mut f64,
    pub exposure: &'a mut f32,
    pub mode: &'a mut LightMode,
    pub edit: &'a mut Edit,
    pub baked_albedo: DVec3,
    /// Whether the surface reflects at all.
    pub refracts: bool,
    /// The object's middle and diagonal, for new lights and the speed of dragging.
    pub centre: DVec3,
    pub diagonal: f64,
    pub numbers: Numbers<'a>,
    /// The last thing that happened.
    pub message: &'a str,
}

/// What the panel reports.
pub struct Numbers<'a> {
    pub adapter: &'a str,
    pub frame_ms: f64,
    pub size: [u32; 2],
    pub rays: u32,
    pub rays_wanted: u32,
    pub samples: u64,
    /// Of detail, where they are chosen by a budget.
    pub level: Option<usize>,
    pub statistics: &'a Statistics,
    /// Of the last frame.
    pub exact: &'a ExactReport,
}

/// Buttons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    SavePng,
    SaveExr,
    MeasureExposure,
    ResetCamera,
}

/// Draws the panel; returns the button that was pressed.
pub fn show(ui: &mut Ui, contents: &mut Contents) -> Option<Action> {
    let mut action = None;
    egui::ScrollArea::vertical().show(ui, |ui| {
        ui.heading("diaphane");
        statistics(ui, &contents.numbers);
        ui.separator();
        action = picture(ui, contents);
        ui.separator();
        material(ui, contents.edit, contents.baked_albedo);
        ui.separator();
        lights(ui, contents);
    });
    action
}

fn statistics(ui: &mut Ui, numbers: &Numbers) {
    let counters = &numbers.statistics.counters;
    ui.label(RichText::new(numbers.adapter).small());
    Grid::new("statistics").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(name);
            ui.monospace(value);
            ui.end_row();
        };
        row("frames / s", format!("{:.1}", 1000.0 / numbers.frame_ms.max(1e-3)));
        row("picture", format!("{} x {}", numbers.size[0], numbers.size[1]));
        row("rays a pixel", format!("{} of {}", numbers.rays, numbers.rays_wanted));
        row("samples", format!("{} of {}", counters.samples_drawn, numbers.samples));
        if let Some(level) = numbers.level {
            let light = if level > 0 { ", baked light" } else { "" };
            row("level of detail", format!("{level}{light}"));
        }
        let census = &counters.census;
        let share = |n: u64| n / census.views.max(1);
        row("shown, hidden", format!("{}, {}", share(census.samples_shown), share(census.samples_hidden)));
        row("splats a ray", format!("{:.1}", counters.splats_per_ray()));
        if counters.pieces_dropped > 0 {
            row("pieces not drawn", counters.pieces_dropped.to_string());
        }
    });
    exact_depths(ui, numbers.exact);
    CollapsingHeader::new("Passes, ms").default_open(true).show(ui, |ui| {
        if numbers.statistics.passes.is_empty() {
            ui.label("this adapter has no clock");
        }
        Grid::new("passes").num_columns(2).show(ui, |ui| {
            for (name, ms) in &numbers.statistics.passes {
                ui.label(*name);
                ui.monospace(format!("{ms:8.2}"));
                ui.end_row();
            }
        });
    });
}

/// How many lights have exact depths, what that costs, and what error the baked ones have.
fn exact_depths(ui: &mut Ui, report: &ExactReport) {
    CollapsingHeader::new("Exact light").default_open(false).show(ui, |ui| {
        Grid::new("exact").num_columns(2).show(ui, |ui| {
            let mut row = |name: &str, value: String| {
                ui.label(name);
                ui.monospace(value);
                ui.end_row();
            };
            row("exact", report.exact.to_string());
            row("fading, in progress", format!("{}, {}", report.fading, report.waiting));
            row("baked", report.baked.to_string());
            if report.crowded > 0 {
                row("no memory for", report.crowded.to_string());
            }
            row("ms, memory", format!("{:.2}, {} MiB", report.milliseconds, report.bytes >> 20));
            for error in &report.errors {
                let name = format!("baked error, light {}", error.light + 1);
                row(&name, format!("{:.2} %", 100.0 * error.relative));
            }
        });
    });
}

fn picture(ui: &mut Ui, contents: &mut Contents) -> Option<Action> {
    let mut action = None;
    ui.horizontal(|ui| {
        // In photographic stops: a factor of two each.
        let mut stops = contents.exposure.max(1e-12).log2();
        if ui.add(Slider::new(&mut stops, -12.0..=12.0).text("exposure")).changed() {
            *contents.exposure = stops.exp2();
        }
        if ui.button("auto").clicked() {
            action = Some(Action::MeasureExposure);
        }
    });
    ui.horizontal(|ui| {
        ui.add(Slider::new(contents.fov_degrees, 5.0..=120.0).text("field of view").suffix("°"));
        if ui.button("reset").on_hover_text("Back to the first camera").clicked() {
            action = Some(Action::ResetCamera);
        }
    });
    if contents.refracts {
        let surface = &mut contents.scene.surface;
        ui.checkbox(&mut surface.reflection, "reflection");
        ui.add_enabled(surface.reflection, Slider::new(&mut surface.specular, 0.0..=2.0).text("strength"));
        ui.add_enabled(surface.reflection, Slider::new(&mut surface.roughness, 0.05..=1.0).text("roughness"));
    }
    ui.horizontal(|ui| {
        ui.label("depth to lights:");
        for (mode, name) in
            [(LightMode::Auto, "auto"), (LightMode::Baked, "baked"), (LightMode::Exact, "exact")]
        {
            ui.selectable_value(contents.mode, mode, name);
        }
    });
    ui.horizontal(|ui| {
        if ui.button("Save PNG").clicked() {
            action = Some(Action::SavePng);
        }
        if ui.button("Save EXR").clicked() {
            action = Some(Action::SaveExr);
        }
    });
    ui.label(RichText::new(contents.message).small());
    ui.label(RichText::new("drag: turn   right drag: move   wheel: distance").small());
    action
}

/// Factors on the extinction, all channels together and one by one, and the albedo.
fn material(ui: &mut Ui, edit: &mut Edit, baked_albedo: DVec3) {
    let slider = |ui: &mut Ui, value: &mut f64, name: &str| {
        // What the command line asked for may lie outside.
        let slider = Slider::new(value, SCALES).logarithmic(true).clamping(SliderClamping::Edits);
        ui.add(slider.text(name)).changed()
    };
    let scale = &mut edit.extinction_scale;
    let before = scale.max_element();
    let mut all = before;
    if slider(ui, &mut all, "extinction x") {
        *scale = if before > 0.0 { *scale * (all / before) } else { DVec3::splat(all) };
    }
    CollapsingHeader::new("Channels").default_open(false).show(ui, |ui| {
        slider(ui, &mut scale.x, "red x");
        slider(ui, &mut scale.y, "green x");
        slider(ui, &mut scale.z, "blue x");
    });
    if let Some(warning) = edit.warning() {
        ui.label(RichText::new(warning).small());
    }
    ui.horizontal(|ui| {
        let mut rgb = edit.albedo.unwrap_or(baked_albedo).as_vec3().to_array();
        if ui.color_edit_button_rgb(&mut rgb).changed() {
            edit.albedo = Some(DVec3::from_array(rgb.map(f64::from)).clamp(DVec3::ZERO, DVec3::ONE));
        }
        ui.label("albedo");
        if ui.button("as baked").on_hover_text("The material that was baked").clicked() {
            *edit = Edit::default();
        }
    });
}

fn lights(ui: &mut Ui, contents: &mut Contents) {
    let speed = 0.005 * contents.diagonal;
    let (mut gone, mut marked) = (None, None);
    let marks = contents.scene.exact.clone();
    for (i, light) in contents.scene.lights.iter_mut().enumerate() {
        let title = format!("Light {}: {}", i + 1, kind(light));
        CollapsingHeader::new(title).id_salt(("light", i)).default_open(i == 0).show(ui, |ui| {
            edit(ui, light, speed);
            ui.horizontal(|ui| {
                let mut exact = marks.get(i).copied().unwrap_or(false);
                let hint = "Its depths are computed before those of others";
                if ui.checkbox(&mut exact, "exact").on_hover_text(hint).changed() {
                    marked = Some((i, exact));
                }
                if ui.button("remove").clicked() {
                    gone = Some(i);
                }
            });
        });
    }
    if let Some((i, exact)) = marked {
        contents.scene.mark_exact(i, exact);
    }
    if let Some(i) = gone {
        contents.scene.remove_light(i);
    }
    if contents.scene.environment.is_some() {
        ui.label("and the scene's environment");
    }
    ui.horizontal(|ui| {
        ui.label("add:");
        let away = contents.diagonal;
        let position = contents.centre + DVec3::new(away, away, away);
        let direction = -DVec3::ONE.normalize();
        let intensity = DVec3::splat(4.0 * 3.0 * away * away);
        if ui.button("point").clicked() {
            contents.scene.lights.push(Light::Point { position, intensity });
        }
        if ui.button("directional").clicked() {
            contents.scene.lights.push(Light::Directional { direction, irradiance: DVec3::splat(4.0) });
        }
        if ui.button("spot").clicked() {
            let (cos_inner, cos_outer) = (10f64.to_radians().cos(), 15f64.to_radians().cos());
            contents.scene.lights.push(Light::Spot { position, direction, intensity, cos_inner, cos_outer });
        }
    });
}

fn kind(light: &Light) -> &'static str {
    match light {
        Light::Point { .. } => "point",
        Light::Directional { .. } => "directional",
        Light::Spot { .. } => "spot",
    }
}

fn edit(ui: &mut Ui, light: &mut Light, speed: f64) {
    match light {
        Light::Point { position, intensity } => {
            vector(ui, "position", position, speed);
            colour(ui, "intensity", intensity);
        }
        Light::Directional { direction, irradiance } => {
            heading(ui, direction);
            colour(ui, "irradiance", irradiance);
        }
        Light::Spot { position, direction, intensity, cos_inner, cos_outer } => {
            vector(ui, "position", position, speed);
            heading(ui, direction);
            colour(ui, "intensity", intensity);
            let (mut inner, mut outer) = (cos_inner.acos().to_degrees(), cos_outer.acos().to_degrees());
            let a = ui.add(Slider::new(&mut inner, 0.0..=90.0).text("inner angle"));
            let b = ui.add(Slider::new(&mut outer, 0.0..=90.0).text("outer angle"));
            if a.changed() || b.changed() {
                *cos_inner = inner.to_radians().cos();
                *cos_outer = outer.max(inner).to_radians().cos();
            }
        }
    }
}

fn vector(ui: &mut Ui, name: &str, value: &mut DVec3, speed: f64) -> bool {
    let mut changed = false;
    ui.horizontal(|ui| {
        for v in [&mut value.x, &mut value.y, &mut value.z] {
            changed |= ui.add(DragValue::new(v).speed(speed).max_decimals(3)).changed();
        }
        ui.label(name);
    });
    changed
}

/// A direction stays a unit vector.
fn heading(ui: &mut Ui, direction: &mut DVec3) {
    let mut value = *direction;
    if vector(ui, "direction", &mut value, 0.01) {
        *direction = value.try_normalize().unwrap_or(*direction);
    }
}

/// Strength, and colour with its brightest channel at 1.
fn colour(ui: &mut Ui, name: &str, value: &mut DVec3) {
    let mut strength = value.max_element();
    let unit = if strength > 0.0 { *value / strength } else { DVec3::ONE };
    let mut rgb = unit.as_vec3().to_array();
    ui.horizontal(|ui| {
        let a = ui.color_edit_button_rgb(&mut rgb);
        // Never quite 0, so that the colour is not forgotten.
        let speed = 0.01 * strength.max(0.01);
        let drag = DragValue::new(&mut strength).speed(speed).range(1e-9..=1e9);
        let b = ui.add(drag);
        ui.label(name);
        if a.changed() || b.changed() {
            *value = DVec3::from_array(rgb.map(f64::from)) * strength;
        }
    });
}
