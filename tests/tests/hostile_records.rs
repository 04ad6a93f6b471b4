//! Measurements that a sweep keeps for itself, damaged at random: lines that cannot be read are dropped and said.

#[path = "support/hostile/mutate.rs"]
mod mutate;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use validation::sweep::store::Store;

#[test]
fn damaged_measurements_are_dropped_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("records");
    let nested = "[".repeat(5000);
    let line = r#"{"key":{"case":"a","inputs":"b","version":"c","method":"splats","samples":1,"order":2,"encoding":"-"}}"#;
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for i in 0..500 {
        let bytes = mutate::mutated(line.as_bytes(), nested.as_bytes(), &mut rng);
        std::fs::write(&path, &bytes).unwrap();
        let (_, said) = Store::open(&path).unwrap();
        let lines = bytes.split(|b| *b == b'\n').filter(|line| !line.is_empty()).count();
        assert_eq!(said.len(), lines, "{i}: {said:?}");
        // What was damaged is gone.
        assert!(Store::open(&path).unwrap().1.is_empty());
    }
    std::fs::write(&path, nested).unwrap();
    assert_eq!(Store::open(&path).unwrap().1.len(), 1);
}
