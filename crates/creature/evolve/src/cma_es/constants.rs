//! The constants of CMA-ES.

use super::CmaEsSettings;

/// What the number of genes and of genomes makes of the tutorial's table 1.
pub(super) struct Constants {
    pub weights: Vec<f64>,
    pub mu_eff: f64,
    pub c_sigma: f64,
    pub d_sigma: f64,
    pub c_c: f64,
    pub c_1: f64,
    pub c_mu: f64,
    /// Expected length of a normal vector.
    pub chi: f64,
}

impl Constants {
    pub fn new(settings: &CmaEsSettings, genes: usize) -> Self {
        let (n, lambda) = (genes as f64, settings.lambda(genes));
        // Equations 49 to 53; the sums are of the positive and of the negative half.
        let rank = |i: usize| libm::log((lambda as f64 + 1.0) / 2.0) - libm::log(i as f64);
        let mut weights: Vec<_> = (1..=lambda).map(rank).collect();
        let (good, bad) = weights.split_at_mut(lambda / 2);
        let sum = |half: &[f64]| half.iter().sum::<f64>().abs();
        let effective = |half: &[f64]| {
            sum(half) * sum(half) / half.iter().map(|w| w * w).sum::<f64>().max(1e-300)
        };
        let (mu_eff, mu_bad) = (effective(good), effective(bad));
        // Equations 55 to 58.
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let excess = ((mu_eff - 1.0) / (n + 1.0)).max(0.0).sqrt() - 1.0;
        let c_c = (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n);
        // Ros and Hansen: what has fewer numbers to learn learns them faster.
        let faster = if settings.diagonal(genes) { (n + 2.0) / 3.0 } else { 1.0 };
        let c_1 = (faster * 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff)).min(0.5);
        let rate = 2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((n + 2.0) * (n + 2.0) + mu_eff);
        let c_mu = (faster * rate).min(1.0 - c_1);
        let negative = if settings.active {
            let balanced = 1.0 + c_1 / c_mu;
            let informed = 1.0 + 2.0 * mu_bad / (mu_eff + 2.0);
            let definite = (1.0 - c_1 - c_mu) / (n * c_mu);
            balanced.min(informed).min(definite)
        } else {
            0.0
        };
        let (good_sum, bad_sum) = (sum(good), sum(bad));
        good.iter_mut().for_each(|weight| *weight /= good_sum);
        bad.iter_mut().for_each(|weight| *weight *= negative / bad_sum);
        Self {
            weights,
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + 2.0 * excess.max(0.0) + c_sigma,
            c_c,
            c_1,
            c_mu,
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 for n = 10, λ = 10, worked out by hand from the tutorial.
    #[test]
    fn constants_are_those_of_the_tutorial() {
        let settings = CmaEsSettings { population: 10, ..Default::default() };
        let c = Constants::new(&settings, 10);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 2e-4, "{found}");
        near(c.mu_eff, 3.1673);
        near(c.weights[0], 0.4563);
        near(c.c_sigma, 5.1673 / 18.1673);
        near(c.d_sigma, 1.0 + 5.1673 / 18.1673);
        near(c.c_c, 4.31673 / 14.63346);
        near(c.c_1, 2.0 / (127.69 + 3.1673));
        near(c.c_mu, 2.0 * (0.25 + 3.1673 + 1.0 / 3.1673 - 2.0) / (144.0 + 3.1673));
        near(c.chi, 3.0847);
        near(c.weights[..5].iter().sum(), 1.0);
        let balanced = -(1.0 + c.c_1 / c.c_mu);
        near(c.weights[5..].iter().sum(), balanced);
        let passive = CmaEsSettings { active: false, ..settings };
        assert!(Constants::new(&passive, 10).weights[5..].iter().all(|&weight| weight == 0.0));
    }
}
