//! The sums of a pixel's rays over its sub-pixels.

use std::ops::Range;

use super::workspace::Workspace;

impl Workspace {
    /// out[s] += Σ radiance · weight · measure over those rays of a pixel that passed. Where there is `self.walls`,
    /// walls[sums] += Σ weight · measure; where there is `self.far`, rays displaced by more than `far_from` over
    /// wavelength go there.
    pub fn splat(
        &mut self,
        (channel, pixel): (usize, usize),
        far_from: f64,
        out: &mut [f64],
        sums: Range<usize>,
    ) {
        let (mut walls, mut far) = (
            std::mem::take(&mut self.walls),
            std::mem::take(&mut self.far),
        );
        let is_far = |ray: usize| {
            let [x, y] = &self.displacements;
            x[ray] * x[ray] + y[ray] * y[ray] > far_from * far_from
        };
        let n_sub = out.len();
        match (walls.is_empty(), far[0].is_empty()) {
            (true, true) => add_weighted(
                self.weighted(channel, pixel, n_sub, |_, l, m| [l * m]),
                [out],
            ),
            (false, true) => {
                let rays = self.weighted(channel, pixel, n_sub, |_, l, m| [l * m, m]);
                add_weighted(rays, [out, &mut walls[sums]]);
            }
            (_, false) => {
                let near = |i, l, m| [if is_far(i) { 0.0 } else { l * m }, m];
                let rays = self.weighted(channel, pixel, n_sub, near);
                let mut unused = [0.0; 16];
                let walls = match walls.is_empty() {
                    true => &mut unused[..n_sub],
                    false => &mut walls[sums.clone()],
                };
                add_weighted(rays, [out, walls]);
                let [light, whites] = far.each_mut().map(|all| &mut all[sums.clone()]);
                // They are few.
                let all = self.segments[pixel].rays.clone();
                for i in all.filter(|&i| is_far(i) && self.batch.status[i] == 0) {
                    let measure = self.measure[i];
                    let radiance = f64::from(self.radiance[channel][i]) * measure;
                    for (s, &weight) in self.weights[i * n_sub..][..n_sub].iter().enumerate() {
                        light[s] += radiance * f64::from(weight);
                        whites[s] += measure * f64::from(weight);
                    }
                }
            }
        }
        (self.walls, self.far) = (walls, far);
    }

    /// What each ray of a pixel carries, by its number, radiance and measure, with its weights.
    #[inline(always)]
    fn weighted<const K: usize>(
        &self,
        channel: usize,
        pixel: usize,
        n_sub: usize,
        carries: impl Fn(usize, f64, f64) -> [f64; K],
    ) -> impl Iterator<Item = ([f64; K], &[f32])> {
        let range = self.segments[pixel].rays.clone();
        let rays = range
            .clone()
            .zip(&self.radiance[channel][range.clone()])
            .zip(&self.measure[range.clone()])
            .zip(self.weights[range.start * n_sub..].chunks_exact(n_sub))
            .zip(&self.batch.status[range]);
        rays.map(move |((((i, &radiance), &measure), weights), &status)| {
            // A lost ray carries nothing; its radiance may be that of a meaningless hit.
            match status == 0 {
                true => (carries(i, f64::from(radiance), measure), weights),
                false => ([0.0; K], weights),
            }
        })
    }
}

/// out_k[s] += Σ value_k · weight[s] over rays.
#[inline(always)]
fn add_weighted<'a, const K: usize>(
    rays: impl Iterator<Item = ([f64; K], &'a [f32])>,
    outs: [&mut [f64]; K],
) {
    // Four sub-pixels stay in registers.
    if outs.iter().all(|out| out.len() == 4) {
        let mut sums = [[0.0; 4]; K];
        for (sums, out) in sums.iter_mut().zip(&outs) {
            sums.copy_from_slice(out);
        }
        for (values, weights) in rays {
            if let Ok(weights) = <&[f32; 4]>::try_from(weights) {
                for (sums, value) in sums.iter_mut().zip(values) {
                    (0..4).for_each(|s| sums[s] += value * f64::from(weights[s]));
                }
            }
        }
        for (out, sums) in outs.into_iter().zip(&sums) {
            out.copy_from_slice(sums);
        }
        return;
    }
    let mut outs = outs;
    for (values, weights) in rays {
        for (out, value) in outs.iter_mut().zip(values) {
            for (o, &w) in out.iter_mut().zip(weights) {
                *o += value * f64::from(w);
            }
        }
    }
}
