//! Packs many maps into few textures.

use crunch::{Item, PackedItem, Rect, Rotation};

use super::index::Rectangle;
use crate::error::{Error, Result};

/// Layout of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasOptions {
    /// Maximum side of a texture [texels], > 0.
    pub most_side: usize,
    /// Texels around each map that repeat its border.
    pub gutter: usize,
    /// Rectangles are aligned to multiples of this [texels].
    pub grid: usize,
}

/// One texture of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Maps in it by index, and where their texels are, without the gutter.
    pub places: Vec<(usize, Rectangle)>,
}

/// Packs maps of some sizes, each with its gutter, into few textures with sides of powers of two.
///
/// # Errors
/// A map that is larger than the maximum texture; `name` gives its name.
pub fn pack(
    sizes: &[(usize, usize)],
    options: AtlasOptions,
    name: impl Fn(usize) -> String,
) -> Result<Vec<Page>> {
    // A map takes its texels, a gutter on either side, and whole blocks where texels are compressed by block.
    let cell = |side: usize| (side + 2 * options.gutter).next_multiple_of(options.grid);
    for (map, &(width, height)) in sizes.iter().enumerate() {
        if cell(width.max(height)) > options.most_side {
            return Err(Error::failure(
                name(map),
                format!(
                    "its {width}x{height} texels with a gutter of {} are more than an atlas of {} holds",
                    options.gutter, options.most_side
                ),
                "allow a larger one (--atlas N)",
            ));
        }
    }

    let mut left: Vec<usize> = (0..sizes.len()).collect();
    let mut pages = Vec::new();
    while !left.is_empty() {
        // A page of a shape takes what fits into it, which the packer returns even if something is left over.
        let fill = |(width, height): (usize, usize)| {
            let items = left.iter().map(|&map| {
                let (width, height) = sizes[map];
                Item::new(map, cell(width), cell(height), Rotation::None)
            });
            let packed = crunch::pack(Rect::of_size(width, height), items);
            let place = |packed: PackedItem<usize>| {
                let (width, height) = sizes[packed.data];
                let [x, y] = [packed.rect.x, packed.rect.y].map(|at| at + options.gutter);
                (packed.data, Rectangle { x, y, width, height })
            };
            let packed = packed.unwrap_or_else(|some| some).into_iter();
            let mut places: Vec<(usize, Rectangle)> = packed.map(place).collect();
            places.sort_unstable_by_key(|(map, _)| *map);
            Page {
                width,
                height,
                places,
            }
        };

        // The smallest shape that holds all the rest wastes the least memory. Where none does, the largest is filled.
        let holds_all = |page: &Page| page.places.len() == left.len();
        let page = shapes(options.most_side)
            .into_iter()
            .map(fill)
            .find(holds_all)
            .unwrap_or_else(|| fill((options.most_side, options.most_side)));
        left.retain(|map| page.places.iter().all(|(placed, _)| placed != map));
        pages.push(page);
    }
    Ok(pages)
}

/// Squares and half squares with sides of powers of two, smallest first.
fn shapes(most_side: usize) -> Vec<(usize, usize)> {
    let sides = (0..usize::BITS).map(|power| 1 << power);
    let sides = sides.take_while(|side| *side <= most_side);
    sides
        .flat_map(|side: usize| [(side, side.div_ceil(2)), (side, side)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: AtlasOptions = AtlasOptions {
        most_side: 256,
        gutter: 2,
        grid: 4,
    };

    #[test]
    fn no_map_lies_on_another_and_all_lie_somewhere() {
        let sizes: Vec<(usize, usize)> = (0..60)
            .map(|map| (1 + map * 37 % 90, 1 + map * 53 % 70))
            .collect();
        let pages = pack(&sizes, OPTIONS, |_| String::new()).expect("they fit");
        let mut found = vec![0; sizes.len()];
        for page in &pages {
            let mut owners = vec![None; page.width * page.height];
            for (map, place) in &page.places {
                assert_eq!((place.width, place.height), sizes[*map]);
                found[*map] += 1;
                for row in place.y - 2..place.y + place.height + 2 {
                    for column in place.x - 2..place.x + place.width + 2 {
                        let owner = &mut owners[row * page.width + column];
                        assert_eq!(owner.replace(map), None, "with its gutter");
                    }
                }
            }
        }
        assert_eq!(found, vec![1; sizes.len()]);
        let taken: usize = sizes
            .iter()
            .map(|(width, height)| (width + 4) * (height + 4))
            .sum();
        let whole: usize = pages.iter().map(|page| page.width * page.height).sum();
        assert!(taken as f64 > 0.6 * whole as f64, "{taken} of {whole} texels");
    }

    #[test]
    fn a_texture_is_no_larger_than_it_has_to_be() {
        let shape = |sizes: &[(usize, usize)]| {
            let pages = pack(sizes, OPTIONS, |_| String::new()).expect("they fit");
            pages
                .iter()
                .map(|page| (page.width, page.height))
                .collect::<Vec<_>>()
        };
        assert_eq!(shape(&[]), []);
        assert_eq!(shape(&[(28, 28)]), [(32, 32)]);
        assert_eq!(shape(&[(28, 28), (28, 28)]), [(64, 32)]);
        assert_eq!(shape(&[(250, 252), (250, 252)]), [(256, 256), (256, 256)]);
        let refused = pack(&[(253, 1)], OPTIONS, |_| "floor".into()).expect_err("too large");
        assert_eq!(refused.location, "floor");
    }
}
