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
        let mut open: Vec<(usize, &mut Pool)> = self.0.iter_mut().zip(0..).filter_map(own(owner)).collect();
        let known = open.iter().find_map(|(pool, p)| Some(Berth { pool: *pool, slot: p.slot_of(object)? }));
        let mut free = || {
            let mut pools = open.iter_mut();
            pools.find_map(|(pool, p)| Some(Berth { pool: *pool, slot: p.take_slot(device, object)? }))
        };
        known.or_else(&mut free).unwrap_or_else(|| {
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

/// Picks the pools of an owner, with their places.
fn own<'a>(
    owner: Option<usize>,
) -> impl FnMut((&'a mut Option<Pool>, usize)) -> Option<(usize, &'a mut Pool)> {
    move |(pool, place)| Some((place, pool.as_mut().filter(|p| p.owner == owner)?))
}

impl Pool {
    /// The slot of an object that is in it.
    fn slot_of(&self, object: usize) -> Option<usize> {
        self.taken.iter().position(|t| *t == Some(object))
    }

    /// A slot for another object, if there is room.
    fn take_slot(&mut self, device: &Device, object: usize) -> Option<usize> {
        if let Some(slot) = self.taken.iter().position(Option::is_none) {
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
