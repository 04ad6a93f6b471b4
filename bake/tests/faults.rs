//! Bakes that are killed, run out of disk, lose their folder or meet each other: the file under the asset's name is the old
//! one or the new one, never a part. `DIAPHANE_KILLS=200` asks for more tries than the 40 of every run.
#![cfg(unix)]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A folder with a mesh, a material and an empty folder for results.
struct Place {
    folder: tempfile::TempDir,
    mesh: PathBuf,
    material: PathBuf,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let written = diaphane_assets::write_all(&folder.path().join("in")).unwrap();
        let statue = written.into_iter().find(|w| w.name == "statue").unwrap();
        std::fs::create_dir(folder.path().join("out")).unwrap();
        Self { mesh: statue.mesh, material: statue.material, folder }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn asset(&self) -> PathBuf {
        self.out().join("a.dph")
    }

    /// A small bake of `seed` to `output`.
    fn bake(&self, seed: u32, output: &Path) -> Command {
        let mut bake = Command::new(env!("CARGO_BIN_EXE_diaphane-bake"));
        bake.arg(&self.mesh).arg("--material").arg(&self.material).arg("--output").arg(output);
        bake.args(["--samples", "800", "--directions", "32", "--sh-order", "3", "--no-certificate"]);
        bake.args(["--seed", &seed.to_string(), "--cache"]).arg(self.folder.path().join("cache"));
        bake.stdout(Stdio::null()).stderr(Stdio::piped());
        bake
    }

    /// What a whole bake of `seed` writes, and how long it takes from nothing.
    fn whole(&self, seed: u32) -> (Vec<u8>, Duration) {
        self.forget();
        let started = Instant::now();
        let path = self.folder.path().join("whole.dph");
        let done = self.bake(seed, &path).output().unwrap();
        assert!(done.status.success(), "{}", text(&done));
        (std::fs::read(path).unwrap(), started.elapsed())
    }

    /// Empties the cache.
    fn forget(&self) {
        let _ = std::fs::remove_dir_all(self.folder.path().join("cache"));
    }
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The last line of a bake that failed as it should: with a message, not a panic.
fn failure(output: &Output) -> String {
    let said = text(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    let last = said.lines().last().unwrap_or_default().to_owned();
    assert!(last.starts_with("error: ") && !said.contains("panicked"), "{said}");
    last
}

/// Waits until a bake begins `stage`.
fn wait_for(bake: &mut Child, stage: &str) -> BufReader<std::process::ChildStderr> {
    let mut lines = BufReader::new(bake.stderr.take().unwrap());
    let mut line = String::new();
    while line.trim_end() != stage {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "ended before '{stage}'");
    }
    lines
}

#[test]
fn killed_at_any_moment_it_leaves_the_old_file_or_the_new_one() {
    let place = Place::new();
    let tries = std::env::var("DIAPHANE_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(40u32);
    let (old, _) = place.whole(1);
    let (new, duration) = place.whole(2);
    assert_ne!(old, new);
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let (mut unchanged, mut replaced) = (0, 0);
    for k in 0..tries {
        // Every other time with what is left of the cache.
        if k % 2 == 0 {
            place.forget();
        }
        std::fs::write(place.asset(), &old).unwrap();
        let mut bake = place.bake(2, &place.asset()).spawn().unwrap();
        std::thread::sleep(duration.mul_f64(1.3 * rng.random::<f64>()));
        bake.kill().unwrap();
        bake.wait().unwrap();
        let found = std::fs::read(place.asset()).unwrap();
        assert!(found == old || found == new, "try {k}: {} bytes of neither", found.len());
        unchanged += u32::from(found == old);
        replaced += u32::from(found == new);
    }
    assert!(unchanged > 0 && replaced > 0, "{unchanged} unchanged, {replaced} replaced");
    // What the killed ones left in the cache serves, and what they left beside the asset goes.
    let done = place.bake(2, &place.asset()).output().unwrap();
    assert!(done.status.success(), "{}", text(&done));
    assert_eq!(std::fs::read_dir(place.out()).unwrap().count(), 1, "something was left behind");
    assert_eq!(std::fs::read(place.asset()).unwrap(), new);
}

#[test]
fn unfinished_files_of_killed_bakes_are_removed_and_counted() {
    let place = Place::new();
    // A bake that is stopped in the middle of its writing, before it gives the file its name.
    // The number is the CRC-32 of "a.dph".
    let [left, other] =
        [".diaphane-0115828d-", ".diaphane-00000000-"].map(|stem| place.out().join(format!("{stem}AbC123")));
    std::fs::write(&left, b"half").unwrap();
    std::fs::write(&other, b"somebody's").unwrap();
    let done = place.bake(1, &place.asset()).output().unwrap();
    assert!(done.status.success() && text(&done).contains("removed 1 unfinished file"), "{}", text(&done));
    assert!(!left.exists() && other.exists());
    let done = place.bake(1, &place.asset()).output().unwrap();
    assert!(done.status.success() && !text(&done).contains("unfinished"), "{}", text(&done));
}

#[test]
fn without_room_on_the_disk_the_old_file_stays() {
    let place = Place::new();
    std::fs::write(place.asset(), b"old").unwrap();
    let bake = place.bake(1, &place.asset());
    // Files may not grow beyond a few kilobytes; the write that would fails.
    let mut limited = Command::new("sh");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh"]);
    limited.arg(bake.get_program()).args(bake.get_args()).stderr(Stdio::piped());
    let last = failure(&limited.output().unwrap());
    assert!(last.contains("write") && last.contains("a.dph"), "{last}");
    assert_eq!(std::fs::read(place.asset()).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(place.out()).unwrap().count(), 1, "something was left behind");
}

#[test]
fn a_folder_that_takes_no_files_is_told_before_any_work() {
    let place = Place::new();
    for output in [Path::new("/proc/self/a.dph"), &place.out().join("missing/a.dph"), &place.out()] {
        let done = place.bake(1, output).output().unwrap();
        let last = failure(&done);
        assert!(last.contains(&output.display().to_string()), "{last}");
        assert!(!text(&done).contains("samples"), "it began to work: {}", text(&done));
    }
}

#[test]
fn a_folder_that_goes_away_meanwhile_is_told() {
    let place = Place::new();
    let mut bake = place.bake(1, &place.asset()).spawn().unwrap();
    let mut lines = wait_for(&mut bake, "samples ...");
    std::fs::remove_dir_all(place.out()).unwrap();
    let mut rest = String::new();
    lines.read_to_string(&mut rest).unwrap();
    assert_eq!(bake.wait().unwrap().code(), Some(2), "{rest}");
    let last = rest.lines().last().unwrap_or_default();
    assert!(last.starts_with("error: ") && last.contains("a.dph") && !rest.contains("panicked"), "{rest}");
}

#[test]
fn an_old_file_that_goes_away_meanwhile_is_no_matter() {
    let place = Place::new();
    let (new, _) = place.whole(1);
    place.forget();
    std::fs::write(place.asset(), b"old").unwrap();
    let mut bake = place.bake(1, &place.asset()).spawn().unwrap();
    let mut lines = wait_for(&mut bake, "samples ...");
    std::fs::remove_file(place.asset()).unwrap();
    lines.read_to_string(&mut String::new()).unwrap();
    assert!(bake.wait().unwrap().success());
    assert_eq!(std::fs::read(place.asset()).unwrap(), new);
}

#[test]
fn two_bakes_of_one_output_leave_one_of_them() {
    let place = Place::new();
    let whole = [place.whole(1).0, place.whole(2).0];
    for _ in 0..5 {
        place.forget();
        let both = [1, 2].map(|seed| place.bake(seed, &place.asset()).spawn().unwrap());
        for bake in both {
            let done = bake.wait_with_output().unwrap();
            assert!(done.status.success(), "{}", text(&done));
        }
        assert!(whole.contains(&std::fs::read(place.asset()).unwrap()));
        assert_eq!(std::fs::read_dir(place.out()).unwrap().count(), 1, "something was left behind");
    }
}
