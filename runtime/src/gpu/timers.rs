//! Time spent in each pass, from the adapter's own clock.

use super::bindings::empty_buffer;
use wgpu::{
    Buffer, BufferUsages, CommandEncoder, ComputePassTimestampWrites, Device, Features, QuerySet,
    QuerySetDescriptor, QueryType, Queue, RenderPassTimestampWrites,
};

/// The passes in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    Lighting,
    Fold,
    Slopes,
    Surface,
    Boundary,
    Segments,
    Profile,
    Outlines,
    Batches,
    Splat,
    Resolve,
}

/// Number of passes.
pub(super) const PASSES: usize = Pass::ALL.len();

impl Pass {
    pub const ALL: [Self; 11] = [
        Self::Lighting,
        Self::Fold,
        Self::Slopes,
        Self::Surface,
        Self::Boundary,
        Self::Segments,
        Self::Profile,
        Self::Outlines,
        Self::Batches,
        Self::Splat,
        Self::Resolve,
    ];

    /// Names and milliseconds of the passes that ran.
    pub fn named(milliseconds: &[f64; PASSES]) -> Vec<(&'static str, f64)> {
        let times = Self::ALL.into_iter().zip(milliseconds);
        times.filter(|(_, ms)| **ms > 0.0).map(|(pass, ms)| (pass.name(), *ms)).collect()
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Lighting => "lighting",
            Self::Fold => "fold",
            Self::Slopes => "slopes",
            Self::Surface => "surface",
            Self::Boundary => "boundary",
            Self::Segments => "segments",
            Self::Profile => "profile",
            Self::Outlines => "outlines",
            Self::Batches => "batches",
            Self::Splat => "splat",
            Self::Resolve => "resolve",
        }
    }
}

/// Queries of one submission.
const QUERIES: u32 = 64;
/// Their bytes; resolving wants multiples of 256.
const BLOCK: u64 = QUERIES as u64 * 8;

/// Timestamps around passes. Without the feature every call does nothing.
pub(super) struct Timers(Option<Clock>);

struct Clock {
    set: QuerySet,
    resolved: Buffer,
    blocks: u64,
    /// Nanoseconds of a tick.
    period: f64,
    /// The pass of each pair of queries, by block.
    passes: Vec<Vec<Pass>>,
}

impl Timers {
    /// Timers for up to `submissions` command buffers between two calls of [`Self::restart`].
    pub fn new(device: &Device, queue: &Queue, submissions: u64) -> Self {
        if !device.features().contains(Features::TIMESTAMP_QUERY) {
            return Self(None);
        }
        let set = device.create_query_set(&QuerySetDescriptor {
            label: Some("timers"),
            ty: QueryType::Timestamp,
            count: QUERIES,
        });
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        Self(Some(Clock {
            set,
            resolved: empty_buffer(device, "timers", submissions * BLOCK, usage),
            blocks: submissions,
            period: f64::from(queue.get_timestamp_period()),
            passes: vec![Vec::new()],
        }))
    }

    /// Timers that measure nothing.
    pub fn off() -> Self {
        Self(None)
    }

    /// Submissions that fit; none without a clock.
    pub fn capacity(&self) -> u64 {
        self.0.as_ref().map_or(u64::MAX, |c| c.blocks)
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        if let Some(clock) = &mut self.0 {
            clock.passes = vec![Vec::new()];
        }
    }

    /// What a render pass should write.
    pub fn render(&mut self, pass: Pass) -> Option<RenderPassTimestampWrites<'_>> {
        let clock = self.0.as_mut()?;
        let first = clock.next(pass)?;
        Some(RenderPassTimestampWrites {
            query_set: &clock.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// What a compute pass should write.
    pub fn compute(&mut self, pass: Pass) -> Option<ComputePassTimestampWrites<'_>> {
        let clock = self.0.as_mut()?;
        let first = clock.next(pass)?;
        Some(ComputePassTimestampWrites {
            query_set: &clock.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Ends a submission: its queries leave the set, which the next one uses again.
    pub fn close(&mut self, encoder: &mut CommandEncoder) {
        let Some(clock) = &mut self.0 else { return };
        let block = clock.passes.len() as u64 - 1;
        let used = 2 * clock.passes[block as usize].len() as u32;
        if used > 0 && block < clock.blocks {
            encoder.resolve_query_set(&clock.set, 0..used, &clock.resolved, block * BLOCK);
        }
        clock.passes.push(Vec::new());
    }

    /// The buffer to read back and its used size; `None` without a clock.
    pub fn buffer(&self) -> Option<(&Buffer, u64)> {
        let clock = self.0.as_ref()?;
        Some((&clock.resolved, (clock.passes.len() as u64 - 1).clamp(1, clock.blocks) * BLOCK))
    }

    /// How to read what [`Self::buffer`] holds now, also when later frames have begun; `None` without a clock.
    pub fn reading(&self) -> Option<Reading> {
        self.0.as_ref().map(|c| Reading { period: c.period, passes: c.passes.clone() })
    }
}

/// Which passes the ticks in a copy of the buffer belong to.
pub(super) struct Reading {
    period: f64,
    passes: Vec<Vec<Pass>>,
}

impl Reading {
    /// Adds up ticks: milliseconds by pass, in the order of [`Pass::ALL`].
    pub fn sum(&self, bytes: &[u8], milliseconds: &mut [f64; PASSES]) {
        for (passes, block) in self.passes.iter().zip(bytes.chunks_exact(BLOCK as usize)) {
            let tick = |i: usize| bytemuck::pod_read_unaligned::<u64>(&block[8 * i..8 * i + 8]);
            for (i, pass) in passes.iter().enumerate() {
                let ticks = tick(2 * i + 1).saturating_sub(tick(2 * i));
                milliseconds[*pass as usize] += ticks as f64 * self.period * 1e-6;
            }
        }
    }
}

impl Clock {
    /// The first of two queries for a pass; `None` when the set is full.
    fn next(&mut self, pass: Pass) -> Option<u32> {
        // `passes` always has a last block: it starts with one and only grows.
        let block = self.passes.last_mut()?;
        let first = 2 * block.len() as u32;
        if first + 2 > QUERIES {
            return None;
        }
        block.push(pass);
        Some(first)
    }
}
