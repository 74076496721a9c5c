//! Uniforms of the shaders; names and order are those of `shaders/eye_pass/`.

use crate::eye_pass::wavelengths::SeenWavelength;
use crate::gpu::layout::shader_struct;
use crate::optics::LinearSrgb;
use crate::optics::glass::Dispersion;
use crate::optics::spectrum::xyz::Matrix3;

shader_struct! {
    /// One picture.
    Frame {
        /// Clip from world axes with the camera at the origin, column by column.
        clip_from_camera: [[f32; 4]; 4],
        /// Scene coordinates [m].
        camera_position: [f32; 3],
        /// What is written is radiance times this.
        radiance_scale: f32,
        /// Seen where nothing is hit [W/(m² sr)]; what the radiance of an environment is multiplied by.
        background: [f32; 3],
        /// Added to the level at which images are looked up; far below zero for the finest one always.
        level_bias: f32,
        /// Unit, where the camera looks.
        forward: [f32; 3],
        /// Pixels of the traced picture across.
        traced_width: f32,
        /// From the picture's middle to its right border, at a distance of 1.
        right: [f32; 3],
        /// Pixels of the traced picture down.
        traced_height: f32,
        /// From the picture's middle to its upper border, at a distance of 1.
        up: [f32; 3],
        /// Angle of a pixel of the traced picture [rad].
        pixel_rad: f32,
        /// By which all of the picture is shifted, right and up [half pictures].
        jitter: [f32; 2],
        /// Pixels of the traced picture per pixel, across and down.
        traced_per_pixel: [f32; 2],
        /// By which the traced picture is looked up off its place, right and down [pixels of it].
        traced_offset: [f32; 2],
        /// Where the scale of false colours begins, and what its steps are multiplied by.
        colour_scale: [f32; 2],
        /// What is written in place of what is no number.
        fault: f32,
        /// Radiance that mirrors show while what they reflect cannot be traced [W/(m² sr)].
        stand_in: f32,
        padding0: f32,
        padding1: f32,
    }
}

shader_struct! {
    /// Where chains begin, and how far they are followed.
    ChainStart {
        /// The camera, local.
        eye: [f32; 3],
        /// Of a local unit [m].
        unit_m: f32,
        /// The media around the eye, see `medium.wgsl`.
        media: [u32; 4],
        /// Distance of the nearest thing that is seen, along the camera's axis, local.
        near: f32,
        /// Chains that carry less than this share of their pixel end.
        branch_threshold: f32,
        /// Most specular surfaces on a chain.
        max_depth: u32,
        /// Up to this many surfaces both ways on are followed, and then the stronger.
        branching_depth: u32,
        /// Lights that are traced.
        light_count: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shader_struct! {
    /// The wavelengths that a picture follows light at.
    SeenWavelengths {
        /// From radiance in linear sRGB to what is seen of it, column by column; a fourth number fills each.
        shares: [[[f32; 4]; 3]; 4],
        /// How many there are.
        count: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
        /// Index of each glass at each wavelength, in groups.
        indices: [[[f32; 4]; 16]; 8],
    }
}

shader_struct! {
    /// One object.
    ObjectRecord {
        /// [`Material::base_colour`](crate::scene::Material::base_colour).
        base_colour: [f32; 3],
        /// Refractive index.
        ior: f32,
        /// [W/(m² sr)].
        emitted_radiance: [f32; 3],
        /// `SURFACE_*`.
        surface: u32,
        /// What its body absorbs [1/m].
        absorption_per_m: [f32; 3],
        /// Whether its back is drawn.
        double_sided: u32,
        /// Record of the illumination map of its front.
        map: u32,
        /// Record of its base colour texture.
        texture: u32,
        /// [0, 1].
        roughness: f32,
        /// Record of what bends its normals.
        bumps: u32,
        /// Part of the surface that its polish covers.
        polish: f32,
        /// Record of the illumination map of its back.
        back_map: u32,
        /// Number of its glass from 1 on, where that parts wavelengths; else 0.
        glass: u32,
        /// Alpha of its texture from which on its surface is there; 0 where it always is.
        alpha_cutoff: f32,
        /// Record of the image that multiplies transmission, roughness and metallic.
        variation: u32,
        /// [0, 1].
        metallic: f32,
        /// [0, 1].
        transmission: f32,
        /// Share of it that is there, times its texture's alpha; negative where all of it is.
        coverage: f32,
        /// Whether it bounds a body.
        solid: u32,
        /// Record of the image of what it emits.
        glow: u32,
        padding0: u32,
        padding1: u32,
        /// Rows of the way from its mesh's coordinates to the scene.
        row_x: [f32; 4],
        row_y: [f32; 4],
        row_z: [f32; 4],
    }
}

shader_struct! {
    /// A lamp.
    LightRecord {
        /// Where it is, local; for suns the way their light travels.
        place: [f32; 3],
        /// `LIGHT_*`.
        kind: u32,
        /// [W/sr], of suns [W/m²].
        strength: [f32; 3],
        /// Cosine of the half-angle of full strength.
        cos_inner: f32,
        /// Of a spot or of what glows, unit, away from the lamp.
        axis: [f32; 3],
        /// Cosine of the half-angle at which it ends.
        cos_outer: f32,
        /// Of what is around it [1/m].
        absorption_per_m: [f32; 3],
        /// Refractive index of that [1].
        ior: f32,
    }
}

shader_struct! {
    /// A node of a hierarchy, of triangles or of instances; or a part of an instance.
    Node {
        /// Minimum corner, local.
        low: [f32; 3],
        /// Of a leaf its first triangle or the first node of its instance, of others the first of two children.
        first: u32,
        /// Maximum corner, local.
        high: [f32; 3],
        /// Triangles of a leaf, or `INSTANCE`; 0 for other nodes.
        count: u32,
    }
}

shader_struct! {
    /// A triangle of a hierarchy. Where its mesh has instances, it has the mesh's coordinates, and they its numbers.
    Triangle {
        /// First corner, local.
        a: [f32; 3],
        /// Index into the scene's objects; `NO_OBJECT` where it is not there any more.
        object: u32,
        /// Second corner, local.
        b: [f32; 3],
        /// Of three indices of its corners.
        first_index: u32,
        /// Third corner, local.
        c: [f32; 3],
        /// Of triangles at the same distance the one of lowest order is met.
        order: u32,
    }
}

shader_struct! {
    /// Which light the display shows as white.
    DisplayWhite {
        /// What radiance is multiplied by, column by column; a fourth number fills each.
        balance: [[f32; 4]; 3],
    }
}

shader_struct! {
    /// How a mean of pictures takes up another one.
    Accumulation {
        /// Share of the new picture in the mean.
        share: f32,
        padding0: f32,
        padding1: f32,
        padding2: f32,
    }
}

shader_struct! {
    /// A ray to be traced for its own sake.
    ProbeRay {
        /// Local.
        origin: [f32; 3],
        padding0: u32,
        /// Unit.
        direction: [f32; 3],
        padding1: u32,
    }
}

shader_struct! {
    /// What a ray met.
    ProbeHit {
        /// Order of the triangle; `NO_TRIANGLE` where nothing was met.
        order: u32,
        /// Local.
        distance: f32,
        padding: [u32; 2],
    }
}

impl DisplayWhite {
    /// By a matrix of [`WhiteBalance::matrix`](crate::eye_pass::WhiteBalance::matrix).
    pub(crate) fn new(matrix: &Matrix3) -> Self {
        let column = |column: usize| {
            let [r, g, b] = matrix.map(|row| row[column] as f32);
            [r, g, b, 0.0]
        };
        Self {
            balance: std::array::from_fn(column),
        }
    }
}

impl SeenWavelengths {
    /// A picture's set, with the indices of the scene's glasses, as many as there is room for.
    pub(crate) fn of(set: &[SeenWavelength], glasses: &[Dispersion]) -> Self {
        let mut seen = Self {
            count: set.len() as u32,
            ..Self::default()
        };
        for (share, at) in seen.shares.iter_mut().zip(set) {
            let columns = at.share.to_cols_array_2d();
            *share = columns.map(|[r, g, b]| [r as f32, g as f32, b as f32, 0.0]);
        }
        let rooms = seen.indices.as_flattened_mut().iter_mut();
        for (room, glass) in rooms.zip(glasses) {
            for (index, at) in room.iter_mut().zip(set) {
                *index = glass.index(at.wavelength) as f32;
            }
        }
        seen
    }
}

/// A colour in single precision.
pub(super) fn rgb(colour: LinearSrgb) -> [f32; 3] {
    colour.to_array().map(|channel| channel as f32)
}
