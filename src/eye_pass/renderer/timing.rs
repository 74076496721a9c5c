//! GPU time of a picture: timestamps in the command stream, read back when they are ready.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use super::EyeQuality;
use super::draws::GpuMs;
use crate::gpu::Gpu;

/// Queries at the beginning and the end of each pass.
const SURFACES: [u32; 2] = [0, 1];
const CHAINS: [u32; 2] = [2, 3];
const TONE_MAPPING: [u32; 2] = [4, 5];
const MARKS: u32 = 6;
/// Alignment of resolved queries [bytes].
const STRIDE: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;
/// One aligned slot per pass.
const BYTES: u64 = 3 * STRIDE;

/// Frames that may be in flight at once; further ones are not timed.
const SLOTS: usize = 3;

const FREE: u8 = 0;
const UNDER_WAY: u8 = 1;
const READABLE: u8 = 2;
const FAILED: u8 = 3;

/// The queries of one frame, being read back.
#[derive(Debug)]
struct Slot {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    /// Which passes were drawn: surfaces, chains, tone mapping.
    passes: [bool; 3],
    quality: EyeQuality,
}

impl Slot {
    /// Queries of the passes that were drawn, each with its offset in the buffers [bytes].
    fn set_marks(&self) -> impl Iterator<Item = (u64, [u32; 2])> + use<> {
        let passes = (0..).zip([SURFACES, CHAINS, TONE_MAPPING]).zip(self.passes);
        passes.filter_map(|((index, marks), was_drawn)| was_drawn.then_some((index * STRIDE, marks)))
    }
}

/// Times frames on devices with timestamp queries.
#[derive(Debug)]
pub(super) struct Timing {
    marks: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    slots: Vec<Slot>,
    /// Duration of one tick [ms].
    tick_ms: f64,
    latest: Option<(GpuMs, EyeQuality)>,
}

impl Timing {
    /// `None` without timestamp queries.
    pub(super) fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        let slot = || Slot {
            buffer: buffer(
                "times read back",
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            ),
            state: Arc::new(AtomicU8::new(FREE)),
            passes: [false; 3],
            quality: EyeQuality::default(),
        };
        Some(Self {
            marks: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: MARKS,
            }),
            resolved: buffer(
                "times",
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            slots: (0..SLOTS).map(|_| slot()).collect(),
            tick_ms: f64::from(gpu.queue.get_timestamp_period()) * 1e-6,
            latest: None,
        })
    }

    /// Times and quality of the latest frame that is done.
    pub(super) fn latest(&self) -> Option<(GpuMs, EyeQuality)> {
        self.latest
    }

    /// Queries around the pass over all surfaces.
    pub(super) fn around_surfaces(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        self.marks(Some(SURFACES[0]), Some(SURFACES[1]))
    }

    /// Query before the passes of chains.
    pub(super) fn before_chains(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        self.marks(Some(CHAINS[0]), None)
    }

    /// Query after the passes of chains.
    pub(super) fn after_chains(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        self.marks(None, Some(CHAINS[1]))
    }

    /// Queries around tone mapping.
    pub(super) fn around_tone_mapping(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        self.marks(Some(TONE_MAPPING[0]), Some(TONE_MAPPING[1]))
    }

    fn marks(&self, begin: Option<u32>, end: Option<u32>) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.marks,
            beginning_of_pass_write_index: begin,
            end_of_pass_write_index: end,
        }
    }

    /// Ends a frame: its times are read back once `encoder` was submitted and the GPU is done.
    pub(super) fn finish(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        has_specular: bool,
        has_tone_mapping: bool,
        quality: EyeQuality,
    ) {
        let is_free = |slot: &&mut Slot| slot.state.load(Ordering::Acquire) == FREE;
        let Some(slot) = self.slots.iter_mut().find(is_free) else {
            return;
        };
        slot.passes = [true, has_specular, has_tone_mapping];
        slot.quality = quality;
        // Only queries that were written; the others are undefined.
        for (place, [begin, end]) in slot.set_marks() {
            encoder.resolve_query_set(&self.marks, begin..end + 1, &self.resolved, place);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &slot.buffer, 0, BYTES);
        slot.state.store(UNDER_WAY, Ordering::Release);
        let state = Arc::clone(&slot.state);
        encoder.map_buffer_on_submit(&slot.buffer, wgpu::MapMode::Read, .., move |outcome| {
            state.store(if outcome.is_ok() { READABLE } else { FAILED }, Ordering::Release);
        });
    }

    /// Collects results that have arrived, without waiting. Returns whether any have.
    pub(super) fn collect(&mut self, gpu: &Gpu) -> bool {
        // Runs the callbacks of finished work. A lost device is reported by whoever draws.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        let mut has_news = false;
        for index in 0..self.slots.len() {
            let slot = &self.slots[index];
            match slot.state.load(Ordering::Acquire) {
                READABLE => {
                    self.latest = self.times(slot).map(|ms| (ms, slot.quality)).or(self.latest);
                    slot.buffer.unmap();
                    has_news = true;
                }
                FAILED => {}
                _ => continue,
            }
            slot.state.store(FREE, Ordering::Release);
        }
        has_news
    }

    /// Whether results are pending.
    pub(super) fn is_waiting(&self) -> bool {
        let states = self.slots.iter().map(|slot| slot.state.load(Ordering::Acquire));
        states.into_iter().any(|state| state != FREE)
    }

    fn times(&self, slot: &Slot) -> Option<GpuMs> {
        let range = slot.buffer.get_mapped_range(..).ok()?;
        let mut ms = [0.0; 3];
        for (place, _) in slot.set_marks() {
            let at = place as usize;
            let [begin, end] =
                bytemuck::pod_read_unaligned::<[u64; 2]>(&range[at..at + size_of::<[u64; 2]>()]);
            ms[at / STRIDE as usize] = end.saturating_sub(begin) as f64 * self.tick_ms;
        }
        let [opaque, specular, tone_mapping] = ms;
        Some(GpuMs {
            opaque,
            specular,
            tone_mapping,
        })
    }
}
