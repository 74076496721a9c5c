//! Places rectangles side by side in the unit square, all at the same scale.

use glam::DVec2;

/// Uncovered texels between neighbours at the nominal resolution: a bilinear look-up at a border reaches one texel
/// beyond it, from both sides.
pub const GUTTER_TEXELS: usize = 2;

/// Halvings of the search for the scale: to a thousandth of a percent.
const SCALE_STEPS: usize = 24;

/// Where the rectangles ended.
#[derive(Debug)]
pub struct Packing {
    /// Corner of least u and v of each rectangle, in the unit square.
    pub low: Vec<DVec2>,
    /// Units of the square per metre.
    pub scale_per_m: f64,
}

/// Packs rectangles of the given sizes [m] (the first side is the longer one) in rows of falling height, at the
/// largest scale at which all fit, with gutters of [`GUTTER_TEXELS`] of a map of `nominal_side` texels and corners on
/// its texels. More rectangles than such a map can hold are packed for a map of twice the side.
pub fn pack(sizes_m: &[DVec2], nominal_side: usize) -> Packing {
    let mut order: Vec<usize> = (0..sizes_m.len()).collect();
    order.sort_by(|&a, &b| {
        sizes_m[b]
            .y
            .total_cmp(&sizes_m[a].y)
            .then(sizes_m[b].x.total_cmp(&sizes_m[a].x))
            .then(a.cmp(&b))
    });
    let area_m2: f64 = sizes_m.iter().map(|size| size.x * size.y).sum();
    let longest_m = sizes_m.iter().fold(0.0f64, |longest, size| longest.max(size.x));
    let mut side = nominal_side.max(8);
    // Half of the map at most goes to gutters.
    while sizes_m.len() * (GUTTER_TEXELS + 1).pow(2) * 2 > side * side {
        side *= 2;
    }
    let mut high = (side as f64 / longest_m).min(side as f64 / area_m2.sqrt());
    let mut low = 0.0;
    let mut best = None;
    for _ in 0..SCALE_STEPS {
        let scale = if best.is_none() {
            0.5 * high
        } else {
            0.5 * (low + high)
        };
        match place(sizes_m, &order, scale, side) {
            Some(places) => {
                best = Some((places, scale));
                low = scale;
            }
            None => high = scale,
        }
    }
    let (places, scale) = best.unwrap_or_else(|| (vec![[0; 2]; sizes_m.len()], 0.0));
    Packing {
        low: places
            .into_iter()
            .map(|[x, y]| DVec2::new(x as f64, y as f64) / side as f64)
            .collect(),
        scale_per_m: scale / side as f64,
    }
}

/// Corners in texels at a scale [texels/m]; `None` where the rectangles do not fit.
fn place(sizes_m: &[DVec2], order: &[usize], scale: f64, side: usize) -> Option<Vec<[usize; 2]>> {
    let mut places = vec![[0; 2]; sizes_m.len()];
    let (mut x, mut y, mut row_height) = (0, 0, 0);
    for &index in order {
        let [width, height] = (sizes_m[index] * scale)
            .to_array()
            .map(|texels| (texels.ceil() as usize).max(1));
        if x + width > side {
            (x, y) = (0, y + row_height + GUTTER_TEXELS);
            row_height = 0;
        }
        if width > side || y + height > side {
            return None;
        }
        places[index] = [x, y];
        x += width + GUTTER_TEXELS;
        row_height = row_height.max(height);
    }
    Some(places)
}
