//! GPU time of a picture: timestamps in the command stream, read back when they are ready.

use std::sync::mpsc::{Receiver, Sender, channel};

use super::EyeQuality;
use super::draws::{GpuMs, TimedFrame};
use crate::gpu::Gpu;

/// Queries at the beginning and the end of a pass. Passes are surfaces, chains, tone mapping, with two queries each.
type Marks = [Option<u32>; 2];

pub(super) const SURFACES: Marks = [Some(0), Some(1)];
pub(super) const BEFORE_CHAINS: Marks = [Some(2), None];
pub(super) const AFTER_CHAINS: Marks = [None, Some(3)];
pub(super) const TONE_MAPPING: Marks = [Some(4), Some(5)];
const PASSES: u32 = 3;
/// Alignment of resolved queries [bytes].
const STRIDE: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;
/// One aligned slot per pass.
const BYTES: u64 = PASSES as u64 * STRIDE;
/// Frames that may be in flight at once; further ones are not timed.
const MAX_PENDING: usize = 3;

/// The queries of one frame, which can be read if `is_mapped`.
#[derive(Debug)]
struct PendingFrame {
    buffer: wgpu::Buffer,
    is_mapped: bool,
    /// Passes that were drawn.
    drawn: [bool; PASSES as usize],
    quality: EyeQuality,
    width: u32,
}

/// Times frames on devices with timestamp queries.
#[derive(Debug)]
pub(super) struct Timing {
    marks: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    frames: (Sender<PendingFrame>, Receiver<PendingFrame>),
    pending: usize,
    /// Duration of one tick [ms].
    tick_ms: f64,
    latest: Option<TimedFrame>,
}

fn buffer(gpu: &wgpu::Device, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.create_buffer(&wgpu::BufferDescriptor {
        label: Some("times"),
        size: BYTES,
        usage,
        mapped_at_creation: false,
    })
}

impl Timing {
    /// `None` without timestamp queries.
    pub(super) fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.tells_times() {
            return None;
        }
        Some(Self {
            marks: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * PASSES,
            }),
            resolved: buffer(
                &gpu.device,
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            frames: channel(),
            pending: 0,
            tick_ms: f64::from(gpu.queue.get_timestamp_period()) * 1e-6,
            latest: None,
        })
    }

    /// The latest frame that is done.
    pub(super) fn latest(&self) -> Option<TimedFrame> {
        self.latest
    }

    /// Queries around a pass.
    pub(super) fn marks(&self, [begin, end]: Marks) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.marks,
            beginning_of_pass_write_index: begin,
            end_of_pass_write_index: end,
        }
    }

    /// Ends a frame: its times are read back once `encoder` was submitted and the GPU is done.
    pub(super) fn finish(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (has_specular, has_tone_mapping): (bool, bool),
        (quality, width): (EyeQuality, u32),
    ) {
        // A device that falls behind is not given more to read back.
        if self.pending == MAX_PENDING {
            return;
        }
        self.pending += 1;
        let drawn = [true, has_specular, has_tone_mapping];

        // Only queries that were written; the others are undefined.
        for (pass, _) in (0..).zip(drawn).filter(|(_, was_drawn)| *was_drawn) {
            let place = u64::from(pass) * STRIDE;
            encoder.resolve_query_set(&self.marks, 2 * pass..2 * pass + 2, &self.resolved, place);
        }

        // Each frame is copied to a buffer of its own, which stays mapped until its times are collected.
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let buffer = buffer(&gpu.device, usage);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &buffer, 0, BYTES);
        let (give, mapped) = (self.frames.0.clone(), buffer.clone());
        encoder.map_buffer_on_submit(&mapped, wgpu::MapMode::Read, .., move |outcome| {
            // Nobody listens once the renderer is gone.
            let _ = give.send(PendingFrame {
                buffer,
                is_mapped: outcome.is_ok(),
                drawn,
                quality,
                width,
            });
        });
    }

    /// Collects results that have arrived, without waiting. Returns whether any have.
    pub(super) fn collect(&mut self, gpu: &Gpu) -> bool {
        // Runs the callbacks of finished work. A lost device is reported by whoever draws.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        let mut has_news = false;
        while let Ok(frame) = self.frames.1.try_recv() {
            self.pending -= 1;
            if frame.is_mapped {
                self.latest = self.times(&frame).or(self.latest);
                has_news = true;
            }
        }
        has_news
    }

    /// Whether results are pending.
    pub(super) fn is_waiting(&self) -> bool {
        self.pending > 0
    }

    fn times(&self, frame: &PendingFrame) -> Option<TimedFrame> {
        let range = frame.buffer.get_mapped_range(..).ok()?;
        let [opaque, specular, tone_mapping] = std::array::from_fn(|pass| {
            let at = pass * STRIDE as usize;
            let [begin, end]: [u64; 2] = bytemuck::pod_read_unaligned(&range[at..at + size_of::<[u64; 2]>()]);
            let ticks = if frame.drawn[pass] {
                end.saturating_sub(begin)
            } else {
                0
            };
            ticks as f64 * self.tick_ms
        });
        Some(TimedFrame {
            ms: GpuMs {
                opaque,
                specular,
                tone_mapping,
            },
            quality: frame.quality,
            width: frame.width,
        })
    }
}
