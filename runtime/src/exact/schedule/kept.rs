//! Complete depths of lights, in so much memory: those go first that were of no use for longest.

use super::Place;
use crate::exact::{Corrections, Depths};
use crate::frame::FrameLight;
use half::f16;
use std::collections::HashMap;
use std::sync::Arc;

/// Complete depths of a light.
pub(super) struct Entry {
    pub light: FrameLight,
    pub place: Place,
    pub depths: Arc<Depths>,
    pub corrections: Arc<Corrections>,
    pub error: f32,
    /// Number of the material that the corrections are for.
    pub material: u64,
}

/// All that is kept.
pub(super) struct Kept {
    /// With the frame in which each was of use last.
    entries: HashMap<Place, (Arc<Entry>, u64)>,
    /// Bytes that they may take.
    memory: u64,
    /// How many went to make room.
    pub evicted: u64,
}

impl Kept {
    pub fn new(memory: u64) -> Self {
        Self { entries: HashMap::new(), memory, evicted: 0 }
    }

    /// What more than so many bytes holds goes, in use or not.
    pub fn set_memory(&mut self, memory: u64) {
        self.memory = memory;
        while self.bytes() > memory {
            let oldest = self.entries.iter().min_by_key(|(place, (_, used))| (*used, place.at));
            let Some(place) = oldest.map(|(place, _)| *place) else { break };
            self.entries.remove(&place);
            self.evicted += 1;
        }
    }

    /// Bytes of all.
    pub fn bytes(&self) -> u64 {
        self.entries.values().map(|(entry, _)| bytes(entry.depths.values().len())).sum()
    }

    pub fn contains(&self, place: &Place) -> bool {
        self.entries.contains_key(place)
    }

    /// Depths for a place; they count as used in `frame`.
    pub fn find(&mut self, place: Place, frame: u64) -> Option<Arc<Entry>> {
        let (entry, used) = self.entries.get_mut(&place)?;
        *used = frame;
        Some(Arc::clone(entry))
    }

    /// Keeps depths for their place, of use in `frame`.
    pub fn insert(&mut self, entry: Arc<Entry>, frame: u64) {
        self.entries.insert(entry.place, (entry, frame));
    }

    /// Others in place of those that are kept for the same place, if any are.
    pub fn renew(&mut self, entry: &Arc<Entry>) {
        if let Some((kept, _)) = self.entries.get_mut(&entry.place) {
            *kept = Arc::clone(entry);
        }
    }

    /// Those that may go, because they are of no use in `frame`.
    fn oldest(&self, frame: u64) -> Option<Place> {
        let unused = self.entries.iter().filter(|(_, (_, used))| *used < frame);
        unused.min_by_key(|(place, (_, used))| (*used, place.at)).map(|(place, _)| *place)
    }

    /// Whether the depths of one more light fit beside all others.
    fn fits(&self, samples: usize) -> bool {
        self.bytes() + bytes(samples) <= self.memory
    }

    /// Whether they fit, or would where others went.
    pub fn may_fit(&self, samples: usize, frame: u64) -> bool {
        self.fits(samples) || self.oldest(frame).is_some()
    }

    /// Sees that they fit; false where all that is kept is in use, or one is too many.
    pub fn make_room(&mut self, samples: usize, frame: u64) -> bool {
        while !self.fits(samples) {
            let Some(oldest) = self.oldest(frame) else { return false };
            self.entries.remove(&oldest);
            self.evicted += 1;
        }
        true
    }
}

/// Of one light's depths and corrections.
fn bytes(samples: usize) -> u64 {
    (samples * (size_of::<[f32; 2]>() + size_of::<[f16; 4]>())) as u64
}
