//! Traces single rays on the device, so that tests can compare its hits with the CPU's.

use std::sync::Arc;

use super::chains::ChainScene;
use super::geometry::Geometry;
use super::shaders::PROBE;
use super::uniforms::{ProbeHit, ProbeRay};
use crate::error::{Error, Result};
use crate::geometry::Ray;
use crate::gpu::{Gpu, readback};
use crate::scene::Scene;

/// Rays per workgroup.
const WORKGROUP: u32 = 64;

/// A hit found on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbedHit {
    /// Index of the triangle over all objects in the scene's order.
    pub triangle: u32,
    /// Distance from the ray's origin [m].
    pub distance_m: f64,
}

/// The nearest triangle on each ray, as chains find it: in single precision. Rays start within a few radii of the
/// scene.
///
/// # Errors
/// A scene or a number of rays that exceeds the device's limits.
pub fn probe(gpu: &Gpu, scene: &Scene, rays: &[Ray]) -> Result<Vec<Option<ProbedHit>>> {
    // All rays are traced by one dispatch, whose workgroups the device limits.
    let groups = (rays.len() as u32).div_ceil(WORKGROUP);
    let limit = gpu.limits().max_compute_workgroups_per_dimension;
    if groups > limit {
        return Err(Error::failure(
            "rays",
            format!("{} are more than the device traces at once", rays.len()),
            format!("trace at most {}", limit * WORKGROUP),
        ));
    }

    // The hierarchy is built even where nothing is traced: a scene beyond the device's limits is an error in any case.
    let geometry = Geometry::new(gpu, scene);
    let chains = ChainScene::new(gpu, &Arc::new(scene.clone()), &geometry, None)?;
    if rays.is_empty() || scene.triangle_count() == 0 {
        return Ok(vec![None; rays.len()]);
    }

    // The device traces in local coordinates, in which the scene's radius is at most one.
    let local: Vec<ProbeRay> = rays
        .iter()
        .map(|ray| ProbeRay {
            origin: chains.local(ray.origin),
            direction: ray.direction.as_vec3().to_array(),
            ..Default::default()
        })
        .collect();
    let hits = run(gpu, &chains, &local, groups)?;
    gpu.take_error().map_or(Ok(()), Err)?;
    let met = |hit: ProbeHit| {
        (hit.order != u32::MAX).then(|| ProbedHit {
            triangle: hit.order,
            distance_m: f64::from(hit.distance) * chains.unit_m(),
        })
    };
    Ok(hits.into_iter().map(met).collect())
}

fn run(gpu: &Gpu, chains: &ChainScene, rays: &[ProbeRay], groups: u32) -> Result<Vec<ProbeHit>> {
    // The layout is derived from the shader, as no other pipeline shares it.
    let pipeline = gpu
        .device
        .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("probe"),
            layout: None,
            module: &PROBE.module(&gpu.device),
            entry_point: Some("probe"),
            compilation_options: Default::default(),
            cache: None,
        });

    // A hit takes half the bytes of a ray.
    let given = gpu.filled_buffer("rays", bytemuck::cast_slice(rays), wgpu::BufferUsages::STORAGE);
    let found = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("hits"),
        size: size_of_val(rays) as u64 / 2,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });

    // Group 1 is that of chains, of which a search for hits reads only nodes and triangles.
    let bind = |group: u32, first: u32, resources: [wgpu::BindingResource<'_>; 2]| {
        let entries: Vec<_> = (first..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("probe"),
            layout: &pipeline.get_bind_group_layout(group),
            entries: &entries,
        })
    };
    let own = bind(0, 0, [given.as_entire_binding(), found.as_entire_binding()]);
    let scene = bind(1, 1, chains.bindings());

    // One invocation traces one ray.
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &own, &[]);
    pass.set_bind_group(1, &scene, &[]);
    pass.dispatch_workgroups(groups, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readback::read_buffer(gpu, &found)?;
    Ok(bytes
        .chunks_exact(size_of::<ProbeHit>())
        .map(bytemuck::pod_read_unaligned)
        .collect())
}
