//! Vectorised code stays in registers: no intrinsic of wide vectors is a function that is called.
//!
//! An intrinsic is inlined only where the instructions that it stands for are enabled. A closure that is called twice, or given to a method such as
//! `Option::map`, becomes a function without them, and then each step of its arithmetic is a call that moves vectors through memory. The picture is the
//! same, and its loops take two to three times as long.

#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
fn no_intrinsic_of_wide_vectors_stays_a_call() {
    use std::collections::BTreeSet;

    let command = organza_tests::organza();
    let program = std::fs::read(command.get_program()).unwrap();
    let text = String::from_utf8_lossy(&program);
    assert!(text.contains("pulp3x862v3"), "the program has no symbols, by which calls are found");
    let is_of_a_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let name = |start: usize| text[start..].chars().take_while(|c| is_of_a_name(*c)).collect::<String>();
    let intrinsics = ["_mm256_", "_mm512_"].into_iter().flat_map(|prefix| text.match_indices(prefix));
    let called: BTreeSet<String> = intrinsics.map(|(start, _)| name(start)).collect();
    assert!(called.is_empty(), "called, not inlined (`objdump -d` tells by what): {called:?}");
}
