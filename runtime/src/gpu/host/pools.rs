//! Objects with the same samples and material share passes and buffers, in which each has a slot for its values and sources.

use crate::gpu::lot::MOST_VIEWS;
use crate::gpu::pipeline::Pipeline;
use diaphane_formats::asset::Info;
use wgpu::{Device, Queue};

/// Bytes of values and sources for which a pool grows. Beyond, objects get pools of their own: they are too large to gain anything
/// by being drawn together.
const MOST_BYTES: u64 = 16 << 20;

/// What draws some of the objects of a level.
pub(super) struct Pool {
    pub pipeline: Pipeline,
    /// The one object that may be in it, because its material is its own.
    owner: Option<usize>,
    /// Which object is in each slot.
    taken: Vec<Option<usize>>,
}

/// All pools of one level of an asset.
#[derive(Default)]
pub(super) struct Pools(Vec<Option<Pool>>);

/// A pool and a slot in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Berth {
    pub pool: usize,
    pub slot: usize,
}

impl Pools {
    /// Finds room for an object; `material` if it has one of its own. `level` is what pools are made of.
    pub fn place(
        &mut self,
        device: &Device,
        queue: &Queue,
        level: &Pipeline,
        object: usize,
        material: Option<&Info>,
    ) -> Berth {
        let owner = material.map(|_| object);
        let found = self.0.iter_mut().enumerate().find_map(|(k, pool)| {
            let pool = pool.as_mut().filter(|p| p.owner == owner)?;
            Some(Berth { pool: k, slot: pool.slot(device, object)? })
        });
        found.unwrap_or_else(|| {
            let mut pipeline = level.instance(device);
            if let Some(info) = material {
                pipeline.set_own_material(device, queue, info);
            }
            let pool = Some(Pool { pipeline, owner, taken: vec![Some(object)] });
            match self.0.iter().position(Option::is_none) {
                Some(hole) => {
                    self.0[hole] = pool;
                    Berth { pool: hole, slot: 0 }
                }
                None => {
                    self.0.push(pool);
                    Berth { pool: self.0.len() - 1, slot: 0 }
                }
            }
        })
    }

    /// Forgets an object.
    pub fn release(&mut self, object: usize) {
        for pool in &mut self.0 {
            if let Some(p) = pool {
                p.taken.iter_mut().filter(|t| **t == Some(object)).for_each(|t| *t = None);
            }
            if pool.as_ref().is_some_and(|p| p.taken.iter().all(Option::is_none)) {
                *pool = None;
            }
        }
    }

    pub fn get(&self, pool: usize) -> Option<&Pool> {
        self.0.get(pool)?.as_ref()
    }

    pub fn get_mut(&mut self, pool: usize) -> Option<&mut Pool> {
        self.0.get_mut(pool)?.as_mut()
    }
}

impl Pool {
    /// The slot of an object that is in it, or one that it takes now, if there is one.
    fn slot(&mut self, device: &Device, object: usize) -> Option<usize> {
        let known = self.taken.iter().position(|t| *t == Some(object));
        let free = || self.taken.iter().position(Option::is_none);
        if let Some(slot) = known.or_else(free) {
            self.taken[slot] = Some(object);
            return Some(slot);
        }
        let asset = &self.pipeline.asset;
        let affordable = MOST_BYTES / asset.slot_bytes().max(1);
        let most = MOST_VIEWS.min(affordable as usize).min(asset.most_slots(device));
        let slot = self.taken.len();
        if self.owner.is_some() || slot >= most {
            return None;
        }
        self.taken.resize((2 * slot).min(most), None);
        self.taken[slot] = Some(object);
        self.pipeline.set_slots(device, self.taken.len());
        Some(slot)
    }
}
