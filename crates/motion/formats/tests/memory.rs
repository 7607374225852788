//! Files that lie about their size cannot make the readers allocate. Alone in its program, since
//! it looks at the memory of the whole process.

use ambulo_formats::ReadOptions;
use ambulo_formats::bvh::read;

/// The most address space that this process ever had, in bytes.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmPeak:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

#[test]
fn an_announced_count_allocates_nothing() {
    let Some(before) = peak() else {
        println!("skipped: no /proc/self/status on this system");
        return;
    };
    for frames in ["1000000000", "18446744073709551615"] {
        let text = format!(
            "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS 1 Xrotation }} MOTION\nFrames: {frames}\n\
             Frame Time: 1\n0\n"
        );
        for repair in [false, true] {
            let options = ReadOptions { repair, ..ReadOptions::default() };
            assert_eq!(read(text.as_bytes(), &options).is_ok(), repair);
        }
    }
    let grown = peak().unwrap() - before;
    assert!(grown < 16 << 20, "{grown} bytes for a file of 100");
}
