//! Noise that is stated as twice what it is hides nothing, and makes no alarm.

use coldplate_base::progress::Silent;
use coldplate_diagnose::{Diagnosis, Problem, Verdict, diagnose};
use coldplate_testing::twin::score::score;
use coldplate_testing::twin::{Family, case};

/// What is said where the noise of readings is stated as so many times what it is.
fn stated(problem: &Problem, times: f64) -> Diagnosis {
    let mut problem = problem.clone();
    problem.uncertainty.noise.iter_mut().for_each(|noise| *noise *= times);
    diagnose(&problem, &Silent).unwrap()
}

#[test]
fn small_effects_are_found_in_noise_that_is_stated_twice() {
    let (mut small, mut found, mut hidden_by_it) = (0, 0, 0);
    for seed in 300..=303 {
        let case = case(seed, Family::One);
        let right = diagnose(&case.problem, &Silent).unwrap();
        let d = score(&case, &right).d;
        if !(5.5..9.0).contains(&d) || right.verdict == Verdict::Consistent || right.misfit.freedom < 50 {
            continue;
        }
        let twice = stated(&case.problem, 2.0);
        println!("seed {seed} d {d:.1}: {:?} {:?}, noise {:.2}: {:?}", right.verdict, right.misfit, twice.noise_share, twice.misfit);
        small += 1;
        found += usize::from(twice.verdict != Verdict::Consistent);
        hidden_by_it += usize::from(twice.noise_share == 1.0);
    }
    println!("{found} of {small}, {hidden_by_it} with the noise as stated");
    assert!(small >= 1 && found == small, "{found} of {small}");
}

#[test]
fn clean_tables_are_silent_in_noise_that_is_stated_twice() {
    let all: Vec<Diagnosis> = (1..=5).map(|seed| stated(&case(seed, Family::Clean).problem, 2.0)).collect();
    assert!(all.iter().all(|found| found.verdict == Verdict::Consistent));
    // Many readings say how large their noise is.
    let many: Vec<f64> = all.iter().filter(|found| found.misfit.freedom > 60).map(|found| found.noise_share).collect();
    println!("{many:?}");
    assert!(many.len() >= 2 && many.iter().all(|share| (0.35..0.8).contains(share)), "{many:?}");
}

/// As if the noise were not known at all.
#[test]
fn noise_that_is_stated_a_hundredfold_is_learnt_too() {
    let clean = stated(&case(1, Family::Clean).problem, 100.0);
    let twice = stated(&case(1, Family::Clean).problem, 2.0);
    println!("{} and {}", clean.noise_share, twice.noise_share);
    assert_eq!(clean.verdict, Verdict::Consistent);
    assert!((50.0 * clean.noise_share / twice.noise_share - 1.0).abs() < 0.15);
    let found = stated(&case(342, Family::One).problem, 100.0);
    assert_ne!(found.verdict, Verdict::Consistent, "{:?}", found.misfit);
}
