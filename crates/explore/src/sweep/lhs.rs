//! Latin hypercubes whose points keep their distance (maximin).

use coldplate_base::random::Random;

/// Pairs of points looked at while improving one design, count. Chosen: bounds the time to about a second.
const PAIRS: usize = 300_000_000;
/// Swaps tried if [`PAIRS`] allows, count. Chosen: more cost time.
const SWAPS: usize = 1_000_000;

/// Number of points up to which the optima are few and far apart, so that several hot annealings find them. Chosen.
const FEW: usize = 20;

/// A Latin hypercube of `count` points: in each variable every level 0..`count` occurs once. Returned in [0, 1],
/// level k at k / (count - 1), so that both ends of every range are used (0.5 for a single point).
///
/// The smallest distance between two points is made large by simulated annealing on the criterion
/// phi = (sum over pairs of d^-p)^(1/p) with p = 20 (M. D. Morris, T. J. Mitchell, Exploratory designs for
/// computational experiments, J. Statist. Plann. Inference 43 (1995) 381-402). A step swaps the levels of two points
/// in one variable. The same seed gives the same design on every machine: only +, -, *, / and sqrt are used.
pub fn maximin(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = Random::new(seed);
    // For many points one long annealing is worth more than several short ones; a single point, a pair or a single
    // variable leaves nothing to choose.
    let nothing_to_choose = count <= 2 || dimensions <= 1;
    let starts = if nothing_to_choose || count > 100 {
        1
    } else if count > FEW {
        2
    } else {
        8
    };
    let mut best: Option<(f64, Vec<Vec<f64>>)> = None;
    for _ in 0..starts {
        let mut design = Design::random(count, dimensions, &mut rng);
        let phi = if nothing_to_choose { 0.0 } else { design.anneal(&mut rng, starts) };
        if best.as_ref().is_none_or(|(least, _)| phi < *least) {
            best = Some((phi, design.levels));
        }
    }
    let levels = best.map(|(_, levels)| levels).unwrap_or_default();
    let unit = |level: f64| if count > 1 { level / (count - 1) as f64 } else { 0.5 };
    (0..count).map(|point| levels.iter().map(|column| unit(column[point])).collect()).collect()
}

#[derive(Debug, Clone)]
struct Design {
    count: usize,
    /// One column per variable: the level of each point, a whole number.
    levels: Vec<Vec<f64>>,
    /// A squared distance that keeps the parts of the criterion near one.
    scale: f64,
}

/// Room for the squared distances from two points to all others.
#[derive(Debug, Clone)]
struct Distances {
    from: [Vec<f64>; 2],
}

/// (scale / d²)^10, a pair's part in phi^20.
fn repulsion(scale: f64, squared: f64) -> f64 {
    let x = scale / squared;
    let x2 = x * x;
    let x4 = x2 * x2;
    x4 * x4 * x2
}

fn power20(x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x16 = x4 * x4 * (x4 * x4);
    x16 * x4
}

/// Sum of the repulsions, in four interleaved parts so that the processor need not wait for each addition.
fn sum(scale: f64, squared: &[f64]) -> f64 {
    let mut parts = [0.0; 4];
    let chunks = squared.chunks_exact(4);
    let rest: f64 = chunks.remainder().iter().map(|s| repulsion(scale, *s)).sum();
    for chunk in chunks {
        for (part, s) in parts.iter_mut().zip(chunk) {
            *part += repulsion(scale, *s);
        }
    }
    parts[0] + parts[1] + (parts[2] + parts[3]) + rest
}

impl Design {
    fn random(count: usize, dimensions: usize, rng: &mut Random) -> Self {
        let column = |order: Vec<usize>| order.into_iter().map(|level| level as f64).collect();
        // Points of a good design lie about n^((d-1)/d) levels apart: between sqrt(n) and n.
        let n = count as f64;
        let scale = if dimensions > 2 { n * n.sqrt() } else { n };
        Self { count, levels: (0..dimensions).map(|_| column(rng.permutation(count))).collect(), scale }
    }

    fn total(&self) -> f64 {
        let squared = |i: usize, j: usize| self.levels.iter().map(|c| (c[i] - c[j]) * (c[i] - c[j])).sum();
        (0..self.count).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| repulsion(self.scale, squared(i, j))).sum()
    }

    /// Change of the criterion by swapping the levels of points `i` and `j` in `variable`. Their own distance stays. The levels
    /// are whole numbers, so the distances are exact.
    fn change(&self, i: usize, j: usize, variable: usize, distances: &mut Distances) -> f64 {
        let mut change = 0.0;
        let column = &self.levels[variable];
        for (squared, (own, other)) in distances.from.iter_mut().zip([(i, j), (j, i)]) {
            squared.fill(0.0);
            for column in &self.levels {
                let x = column[own];
                for (s, y) in squared.iter_mut().zip(column) {
                    *s += (x - y) * (x - y);
                }
            }
            (squared[i], squared[j]) = (f64::INFINITY, f64::INFINITY);
            change -= sum(self.scale, squared);
            let (old, new) = (column[own], column[other]);
            for (s, y) in squared.iter_mut().zip(column) {
                *s += (new - y) * (new - y) - (old - y) * (old - y);
            }
            change += sum(self.scale, squared);
        }
        change
    }

    /// Anneals and returns phi^p. A step that makes phi larger by a factor 1 + x is taken if x is below the temperature times a
    /// random number, which needs no exponential. The temperature begins at 1 for few points, so that any design can be left
    /// again, and at 2/n for many, the share of the points that a swap moves. The temperature falls by e^-12 on a geometric
    /// scale. The best design met is kept.
    fn anneal(&mut self, rng: &mut Random, starts: usize) -> f64 {
        let swaps = (SWAPS.min(PAIRS / (4 * self.count)) / starts).max(100);
        let mut distances = Distances { from: [vec![0.0; self.count], vec![0.0; self.count]] };
        let cooling = 1.0 - 12.0 / swaps as f64;
        let mut temperature = if self.count <= FEW { 1.0 } else { 2.0 / self.count as f64 };
        let mut total = self.total();
        let mut fresh = total;
        let (mut best, mut best_levels) = (total, self.levels.clone());
        for step in 0..swaps {
            temperature *= cooling;
            let (i, j, variable) = (rng.below(self.count), rng.below(self.count), rng.below(self.levels.len()));
            if i == j {
                continue;
            }
            let change = self.change(i, j, variable, &mut distances);
            if total + change <= power20(1.0 + temperature * rng.unit()) * total {
                self.levels[variable].swap(i, j);
                total += change;
                // Differences of sums carry rounding errors of the sum they began with: a fresh sum removes them,
                // now and then, and whenever the sum has become much smaller.
                if total < 0.5 * fresh || step % 1_000 == 0 {
                    total = self.total();
                    fresh = total;
                }
                if total < best {
                    (best, best_levels) = (total, self.levels.clone());
                }
            }
        }
        self.levels = best_levels;
        best
    }
}
