//! The library from Rust, over its C header: a mesh in memory -> quads. Options are set by name, so that no structure of them is repeated here.
//! rustc main.rs -L BUILD -l quadwright (a shared library), as the tests do.
use std::ffi::{c_char, c_int, c_void, CStr, CString};

/// qw_mesh_view: a polygon mesh that somebody else owns.
#[repr(C)]
struct MeshView {
    size: u32,
    vertex_count: u32,
    face_count: u32,
    uniform_face_size: u32,
    positions: *const f64,
    face_sizes: *const u32,
    corners: *const u32,
    marked_edges: *const u32,
    marked_edge_count: u32,
}

extern "C" {
    fn qw_version() -> *const c_char;
    fn qw_options_size() -> usize;
    fn qw_options_init(options: *mut c_void);
    fn qw_option_set(options: *mut c_void, name: *const c_char, value: *const c_char, message: *mut c_char, size: usize) -> c_int;
    fn qw_options_preset(options: *mut c_void, name: *const c_char, message: *mut c_char, size: usize) -> c_int;
    fn qw_remesh(input: *const MeshView, options: *const c_void, host: *const c_void, result: *mut *mut c_void) -> c_int;
    fn qw_result_mesh(result: *const c_void) -> MeshView;
    fn qw_result_message(result: *const c_void) -> *const c_char;
    fn qw_result_destroy(result: *mut c_void);
}

struct Quads {
    positions: Vec<[f64; 3]>,
    quads: Vec<[u32; 4]>,
}

fn text(pointer: *const c_char) -> String {
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

fn remesh(positions: &[[f64; 3]], triangles: &[[u32; 3]], preset: &str, options: &[(&str, &str)]) -> Result<Quads, String> {
    let input = MeshView {
        size: std::mem::size_of::<MeshView>() as u32,
        vertex_count: positions.len() as u32,
        face_count: triangles.len() as u32,
        uniform_face_size: 3,
        positions: positions.as_ptr().cast(),
        face_sizes: std::ptr::null(),
        corners: triangles.as_ptr().cast(),
        marked_edges: std::ptr::null(),
        marked_edge_count: 0,
    };
    unsafe {
        let mut settings = vec![0u64; (qw_options_size() + 7) / 8];
        let at = settings.as_mut_ptr().cast::<c_void>();
        let mut message = [0 as c_char; 256];
        qw_options_init(at);
        let name = CString::new(preset).unwrap();
        if qw_options_preset(at, name.as_ptr(), message.as_mut_ptr(), message.len()) != 0 {
            return Err(text(message.as_ptr()));
        }
        for (name, value) in options {
            let (name, value) = (CString::new(*name).unwrap(), CString::new(*value).unwrap());
            if qw_option_set(at, name.as_ptr(), value.as_ptr(), message.as_mut_ptr(), message.len()) != 0 {
                return Err(text(message.as_ptr()));
            }
        }
        let mut result = std::ptr::null_mut();
        let status = qw_remesh(&input, at, std::ptr::null(), &mut result);
        let told = if status == 0 {
            let mesh = qw_result_mesh(result); // copied, as the result owns it
            Ok(Quads {
                positions: std::slice::from_raw_parts(mesh.positions.cast(), mesh.vertex_count as usize).to_vec(),
                quads: std::slice::from_raw_parts(mesh.corners.cast(), mesh.face_count as usize).to_vec(),
            })
        } else {
            Err(text(qw_result_message(result)))
        };
        qw_result_destroy(result);
        told
    }
}

fn main() {
    let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
    let cube: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let triangles = [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]];
    let made = remesh(&cube, &triangles, "cad", &[("faces", "600")]).expect("a cube has quads");
    println!("quadwright {}: {} quads, {} vertices", text(unsafe { qw_version() }), made.quads.len(), made.positions.len());
    assert!(made.quads.iter().flatten().all(|&v| (v as usize) < made.positions.len()));
    assert!((550..=650).contains(&made.quads.len()));
    let refused = remesh(&cube, &triangles, "cad", &[("faces", "many")]).err().expect("no number");
    assert!(refused.contains("faces"), "{refused}");
}
