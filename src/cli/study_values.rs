//! Values of the studies' options.

use nephroid::settings::MapResolution;

use super::values::map_resolution;

/// `N` (square) or `WxH` [texels].
pub fn fixed_map_resolution(text: &str) -> Result<MapResolution, String> {
    match map_resolution(text) {
        Ok(fixed @ MapResolution::Fixed { .. }) => Ok(fixed),
        _ => Err("give N or WxH in texels, such as 512 or 512x256".to_string()),
    }
}

/// A number of rays, `250000` or `2.5e5`.
pub fn ray_count(text: &str) -> Result<u64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|rays| (1.0..1e18).contains(rays))
        .map(|rays| rays as u64)
        .ok_or_else(|| "give a number of rays, such as 1e8".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_may_be_written_as_powers_of_ten() {
        assert_eq!(ray_count("1e8"), Ok(100_000_000));
        assert_eq!(ray_count("2500"), Ok(2500));
        for text in ["", "0", "-5", "nan", "1e30", "many"] {
            assert!(ray_count(text).is_err(), "{text}");
        }
    }

    #[test]
    fn maps_of_studies_have_a_size() {
        assert!(fixed_map_resolution("auto").is_err());
        let fixed = MapResolution::Fixed { width: 8, height: 4 };
        assert_eq!(fixed_map_resolution("8x4"), Ok(fixed));
    }
}
