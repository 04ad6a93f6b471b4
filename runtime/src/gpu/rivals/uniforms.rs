//! What a dispatch of a rival is told: mirrors rivals/rays.wgsl.

use super::lattice::Lattice;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::ops::Range;

/// What one dispatch does.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    /// Rows of the picture, or listed nodes of the grid.
    pub places: Range<u32>,
    /// Steps of camera rays.
    pub steps: Range<u32>,
    /// Lights.
    pub lights: Range<u32>,
}

/// `Settings` of rivals/rays.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SettingsUniform {
    pub grid_low: Vec3,
    pub nodes: u32,
    pub grid_step: Vec3,
    pub steps: u32,
    pub grid_size: [u32; 3],
    pub first: u32,
    pub end: u32,
    pub stride: f32,
    pub taken_steps: [u32; 2],
    pub taken_lights: [u32; 2],
    pub unused: [u32; 2],
}

impl SettingsUniform {
    /// For a hierarchy of so many nodes, without a grid.
    pub fn new(nodes: u32, steps: u32, stride: f32) -> Self {
        Self { nodes, steps, stride, grid_step: Vec3::ONE, grid_size: [2; 3], ..Self::zeroed() }
    }

    /// With a grid.
    pub fn with_grid(self, lattice: &Lattice) -> Self {
        Self { grid_low: lattice.low, grid_step: lattice.step, grid_size: lattice.size, ..self }
    }

    /// For a part of the work.
    pub fn part(self, part: &Part) -> Self {
        let Part { places, steps, lights } = part;
        let ends = |range: &Range<u32>| [range.start, range.end];
        Self {
            first: places.start,
            end: places.end,
            taken_steps: ends(steps),
            taken_lights: ends(lights),
            ..self
        }
    }
}
