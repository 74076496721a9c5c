//! Uniforms of the shaders; names and order are those of `shaders/eye_pass/`.

use glam::DVec3;

use crate::eye_pass::highlights::Outline;
use crate::eye_pass::wavelengths::SeenWavelength;
use crate::gpu::layout::shader_struct;
use crate::optics::LinearSrgb;
use crate::optics::glass::Dispersion;
use crate::optics::spectrum::xyz::Matrix3;
use crate::scene::PanelShape;
use crate::scene::emitter::{Emitter, EmitterKind};

shader_struct! {
    /// Camera and output of one frame.
    Frame {
        /// Clip space from world axes with the camera at the origin, column-major.
        clip_from_camera: [[f32; 4]; 4],
        /// Scene coordinates [m].
        camera_position: [f32; 3],
        /// Factor of all radiance that is written.
        radiance_scale: f32,
        /// Background radiance [W/(m² sr)], or the factor of the environment's radiance.
        background: [f32; 3],
        /// Added to the mip level of lookups; far below zero to always use the finest.
        level_bias: f32,
        /// Unit view direction.
        forward: [f32; 3],
        /// Width of the traced image [pixels].
        traced_width: f32,
        /// From the image centre to its right edge, at a distance of 1.
        right: [f32; 3],
        /// Height of the traced image [pixels].
        traced_height: f32,
        /// From the image centre to its upper edge, at a distance of 1.
        up: [f32; 3],
        /// Angle of a pixel of the traced image [rad].
        pixel_rad: f32,
        /// Subpixel offset, right and up [half images].
        jitter: [f32; 2],
        /// Pixels of the traced image per pixel of the frame, across and down.
        traced_per_pixel: [f32; 2],
        /// Offset of lookups in the traced image, right and down [its pixels].
        traced_offset: [f32; 2],
        /// Start of the scale of false colours, and the factor of distances from it.
        colour_scale: [f32; 2],
        /// Written in place of values that are not finite.
        fault: f32,
        /// Radiance of mirrors while chains are switched off [W/(m² sr)].
        stand_in: f32,
        /// Number among the frames of the same view.
        picture: u32,
        /// Luminance above which a pixel of the sky belongs to a sun [W/(m² sr)], at the environment's own scale.
        sky_cut: f32,
    }
}

shader_struct! {
    /// A tile of a map in the pool of tiles.
    MapTile {
        /// Its first texel in the pool: column, row, layer.
        corner: [u32; 3],
        /// E [W/m²] of a stored value of 1.
        irradiance_scale: f32,
        /// Column and row of its first texel in its level.
        first_texel: [f32; 2],
        /// Texels of the level that the unit square of coordinates spans.
        extent: [f32; 2],
    }
}

shader_struct! {
    /// Start and limits of chains.
    ChainStart {
        /// Camera position, local.
        eye: [f32; 3],
        /// Length of a local unit [m].
        unit_m: f32,
        /// The media around the eye, see `medium.wgsl`.
        media: [u32; 4],
        /// Distance of the near plane, local.
        near: f32,
        /// Chains with a smaller throughput end.
        branch_threshold: f32,
        /// Maximum number of specular surfaces on a chain.
        max_depth: u32,
        /// Number of surfaces on a chain at which both branches are followed; beyond, only the stronger one is.
        branching_depth: u32,
        /// Number of lights.
        light_count: u32,
        /// Number of lamps that are highlights alone: those of glowing objects and skies. They follow after the lights.
        lobe_lamp_count: u32,
        padding0: u32,
        padding1: u32,
    }
}

shader_struct! {
    /// The wavelengths of a frame.
    SeenWavelengths {
        /// Matrices from radiance in linear sRGB to its part at each wavelength, column-major; columns are padded to
        /// four numbers.
        shares: [[[f32; 4]; 3]; 4],
        count: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
        /// Refractive index of each glass at each wavelength, in groups of 16 glasses.
        indices: [[[f32; 4]; 16]; 8],
    }
}

shader_struct! {
    /// Material and transform of one object.
    ObjectRecord {
        /// [`Material::base_colour`](crate::scene::Material::base_colour).
        base_colour: [f32; 3],
        ior: f32,
        /// [W/(m² sr)].
        emitted_radiance: [f32; 3],
        /// `SURFACE_*`.
        surface: u32,
        /// Absorption coefficient of its interior [1/m].
        absorption_per_m: [f32; 3],
        /// Whether its back is drawn.
        double_sided: u32,
        /// Record of the illumination map of its front.
        map: u32,
        /// Texture reference of its base colour.
        texture: u32,
        /// [0, 1].
        roughness: f32,
        /// Record of its bumps.
        bumps: u32,
        /// Coverage of the coat [0, 1].
        coat: f32,
        /// Record of the illumination map of its back.
        back_map: u32,
        /// Number of its glass, from 1 on, if that is dispersive; else 0.
        glass: u32,
        /// Alpha of its texture below which the surface is cut out; 0 without a mask.
        alpha_cutoff: f32,
        /// Texture reference of the image that multiplies transmission, roughness and metallic.
        variation: u32,
        /// [0, 1].
        metallic: f32,
        /// [0, 1].
        transmission: f32,
        /// Coverage [0, 1], to be multiplied by the texture's alpha; negative if all of the surface is there.
        coverage: f32,
        /// Number of the body that it bounds: index + 1 of the object that stands for it; 0 for none.
        solid: u32,
        /// Texture reference of its emission.
        glow: u32,
        /// Number of the lamp that stands for it, from 1 on; 0 for none.
        lamp: u32,
        padding0: u32,
        /// Rows of the transform from mesh to scene coordinates.
        row_x: [f32; 4],
        row_y: [f32; 4],
        row_z: [f32; 4],
    }
}

shader_struct! {
    /// One light.
    LightRecord {
        /// Position, local or [m]; for suns, the direction in which their light travels.
        place: [f32; 3],
        /// `LIGHT_*`.
        kind: u32,
        /// Intensity [W/sr]; of suns, irradiance [W/m²].
        strength: [f32; 3],
        /// Cosine of the half-angle of full intensity.
        cos_inner: f32,
        /// Unit axis of a spot or unit normal of an emissive facet, away from the light.
        axis: [f32; 3],
        /// Cosine of the half-angle at which the cone ends.
        cos_outer: f32,
        /// Absorption coefficient of the medium around it [1/m].
        absorption_per_m: [f32; 3],
        /// Refractive index of that medium.
        ior: f32,
        /// Half-axes of a panel, local or [m].
        across: [f32; 3],
        /// Radius of a round lamp, local or [m]; of suns the tangent of its angle.
        radius: f32,
        down: [f32; 3],
        /// `OUTLINE_*`.
        outline: u32,
    }
}

shader_struct! {
    /// A node of a hierarchy, of triangles or of instances; or a quarter of an instance.
    Node {
        /// Minimum corner, local.
        low: [f32; 3],
        /// Leaf: its first triangle. Instance: its first node. Others: the first of two adjacent children.
        first: u32,
        /// Maximum corner, local.
        high: [f32; 3],
        /// Number of triangles of a leaf, or `INSTANCE`; 0 for other nodes.
        count: u32,
    }
}

shader_struct! {
    /// A triangle of a hierarchy. In an instanced mesh, coordinates are those of the mesh, and each instance adds the
    /// object and offsets of the numbers.
    Triangle {
        /// First corner, local.
        a: [f32; 3],
        /// Index into the scene's objects; `NO_OBJECT` if it was moved away or belongs to an instanced mesh.
        object: u32,
        /// Second corner, local.
        b: [f32; 3],
        /// Position of the first of its three corner indices.
        first_index: u32,
        /// Third corner, local.
        c: [f32; 3],
        /// Of triangles at the same distance, the one of lowest order is hit.
        order: u32,
    }
}

shader_struct! {
    /// White balance of the display.
    DisplayWhite {
        /// Matrix by which radiance is multiplied, column-major; columns are padded to four numbers.
        balance: [[f32; 4]; 3],
    }
}

shader_struct! {
    /// How a frame enters a running mean.
    Accumulation {
        /// Weight of the new frame.
        share: f32,
        padding0: f32,
        padding1: f32,
        padding2: f32,
    }
}

shader_struct! {
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
    ProbeHit {
        /// Order of the triangle; `NO_TRIANGLE` for a miss.
        order: u32,
        /// Local.
        distance: f32,
        padding: [u32; 2],
    }
}

impl LightRecord {
    /// A light in a vacuum, at its place in the shader's coordinates.
    pub(super) fn of(emitter: &Emitter, placed: impl Fn(DVec3) -> [f32; 3]) -> Self {
        // Medium and outline depend on the scene and are added by the caller.
        let single = |direction: DVec3| direction.as_vec3().to_array();
        let record = Self {
            strength: rgb(emitter.strength),
            ior: 1.0,
            ..Self::default()
        };

        // Kinds are numbered as `LIGHT_*` of `light_record.wgsl`.
        match emitter.kind {
            EmitterKind::Point { position } => Self {
                place: placed(position),
                kind: 0,
                ..record
            },
            EmitterKind::Spot {
                position,
                direction,
                inner_cone_rad,
                outer_cone_rad,
            } => Self {
                place: placed(position),
                kind: 1,
                cos_inner: inner_cone_rad.cos() as f32,
                axis: single(direction),
                cos_outer: outer_cone_rad.cos() as f32,
                ..record
            },
            EmitterKind::Parallel { direction } => Self {
                place: single(direction),
                kind: 2,
                ..record
            },
            EmitterKind::Facet { position, normal } => Self {
                place: placed(position),
                kind: 3,
                axis: single(normal),
                ..record
            },
        }
    }

    /// With its outline, in coordinates of which a unit has a length [m]; without one it is an emissive surface.
    pub(super) fn outlined(self, outline: Option<Outline>, unit_m: f64) -> Self {
        let placed = |axis: DVec3| (axis / unit_m).as_vec3().to_array();
        // Outlines are numbered as `OUTLINE_*` of `light_record.wgsl`.
        match outline {
            None => Self { outline: 3, ..self },
            Some(Outline::Angle { tan_radius }) => Self {
                radius: tan_radius as f32,
                ..self
            },
            Some(Outline::Round { radius_m }) => Self {
                radius: (radius_m / unit_m) as f32,
                ..self
            },
            Some(Outline::Flat { across, down, shape }) => Self {
                across: placed(across),
                down: placed(down),
                outline: match shape {
                    PanelShape::Rectangle => 1,
                    PanelShape::Disc => 2,
                },
                ..self
            },
        }
    }
}

impl DisplayWhite {
    /// From a matrix of [`WhiteBalance::matrix`](crate::eye_pass::WhiteBalance::matrix).
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
    /// The wavelengths of a frame, with the indices of as many of the scene's glasses as fit.
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
