//! What a texture does not hold of its light.

use serde::{Deserialize, Serialize};

use crate::optics::LinearSrgb;

/// Differences between light and what a reader of its file gets. Texels count once, whichever channel is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// Texels above the most that the file holds.
    pub above_texels: usize,
    /// Share of all light that was above it, [0, 1].
    pub above_share: f64,
    /// Texels below 0 (colours outside of sRGB) that became 0.
    pub negative_texels: usize,
    /// Texels with light that was too little for a step and became 0.
    pub vanished_texels: usize,
    /// √(mean((stored − light)²)) / mean(light) of luminance, over all texels of the file; 0 without light.
    pub relative_rmse: f64,
}

impl Loss {
    /// Compares light with what is read of it, texel by texel; `most` is the largest value that the file holds.
    pub fn measure(light: &[[f32; 3]], stored: &[[f32; 3]], most: f32) -> Self {
        let (mut above, mut negative, mut vanished) = (0, 0, 0);
        let (mut all, mut cut, mut squares, mut mean) = (0.0, 0.0, 0.0, 0.0);
        for (wanted, got) in light.iter().zip(stored) {
            let has = |is: &dyn Fn(f32, f32) -> bool| {
                usize::from(wanted.iter().zip(got).any(|(wanted, got)| is(*wanted, *got)))
            };
            above += has(&|wanted, _| wanted > most);
            negative += has(&|wanted, got| wanted < 0.0 && got >= 0.0);
            vanished += has(&|wanted, got| wanted > 0.0 && got <= 0.0);
            for value in wanted {
                all += f64::from(value.max(0.0));
                cut += (f64::from(*value) - f64::from(most)).max(0.0);
            }
            let [wanted, got] = [wanted, got].map(|rgb| LinearSrgb::from(rgb.map(f64::from)).luminance());
            mean += wanted;
            squares += (got - wanted) * (got - wanted);
        }
        let texels = light.len() as f64;
        Self {
            above_texels: above,
            above_share: if all > 0.0 { cut / all } else { 0.0 },
            negative_texels: negative,
            vanished_texels: vanished,
            relative_rmse: if mean > 0.0 {
                (squares / texels).sqrt() / (mean / texels)
            } else {
                0.0
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_loss_is_counted() {
        let light = [[2.0, 1.0, 0.5], [-0.1, 0.2, 0.0], [1e-9, 0.0, 0.0], [0.25; 3]];
        let stored = [[1.0, 1.0, 0.5], [0.0, 0.2, 0.0], [0.0; 3], [0.25; 3]];
        let loss = Loss::measure(&light, &stored, 1.0);
        assert_eq!(
            (loss.above_texels, loss.negative_texels, loss.vanished_texels),
            (1, 1, 1)
        );
        assert!((loss.above_share - 1.0 / 4.45).abs() < 1e-6, "{loss:?}");
        assert!(loss.relative_rmse > 0.0);
        let same = Loss::measure(&light, &light, 10.0);
        assert_eq!((same.above_share, same.relative_rmse), (0.0, 0.0));
    }
}
