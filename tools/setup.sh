#!/bin/bash
# Installs what the build needs and what is missing of it, on Debian and its kin. Quiet, and harmless when run again.
# usage: setup.sh [GROUP...]     build and tests; of GROUP alone where given: musl, mingw, wasm (tools/test-platforms), dist (make dist),
#                        web, web-test (tools/web), python, python-test, python-old (tools/python-package), cluster (tools/test-cluster), blender (tools/blender-addon),
#                        freecad (tools/freecad-addon)
#   build: a C and a C++ compiler, CMake, Ninja, stb (textures), pkg-config (the install test asks it)
#   tests: CMocka, PyYAML (packaging)
#   used where found: CaDiCaL (SAT, Equation (4)), GLPK (--flow ilp), libwebp (textures that are WebP), LEMON (oracle of the flow tests), clang (second compiler, fuzzing), clang-format (layout), ruby and nix (packaging/check.py: the formula, the flake)
set -e
packages=(gcc g++ make cmake ninja-build pkg-config libstb-dev libcmocka-dev cadical libcadical-dev libglpk-dev libwebp-dev liblemon-dev clang libclang-rt-14-dev clang-format-14 python3-yaml ruby nix-bin)
[ $# -gt 0 ] && packages=()
for group; do
    case $group in
    musl) packages+=(g++ musl-tools) ;;
    mingw) packages+=(gcc-mingw-w64-x86-64-posix g++-mingw-w64-x86-64-posix wine wine64) ;;
    wasm) packages+=(emscripten nodejs) ;;
    web) packages+=(emscripten nodejs) && { command -v npm > /dev/null || packages+=(npm); } ;; # some builds of nodejs bring npm
    web-test) packages+=(chromium) ;;
    python) packages+=(python3-build python3-setuptools python3-wheel python3-venv python3-dev python3-numpy) ;;
    python-test) packages+=(python3-pytest python3-meshio python3-vtk9 python3-open3d gmsh python3-distributed python3-tqdm mypy python3-torch python3-pil) ;; # torch and pictures: ComfyUI's
    python-old) packages+=(debootstrap) ;;
    cluster) packages+=(parallel slurm-wlm munge procps) ;;
    blender) packages+=(blender python3-numpy xvfb xauth xdotool libgl1-mesa-dri) ;;
    freecad) packages+=(freecad freecad-python3 python3-numpy xvfb xauth libgl1-mesa-dri) ;;
    dist) packages+=(debootstrap dpkg-dev file zip unzip) ;;
    *) echo "tools/setup.sh: no group $group" >&2; exit 1 ;;
    esac
done

command -v dpkg-query > /dev/null || { echo "tools/setup.sh: not a Debian system; install by hand: ${packages[*]}" >&2; exit 0; }
missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f '${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo > /dev/null || { echo "tools/setup.sh: run as root, or install: ${missing[*]}" >&2; exit 1; }
    as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
"${as_root[@]}" apt-get -qq update > "$log" 2>&1 || true # an old list may do
# One by one, so that a release that lacks an optional package still gets the others. A machine that has just started may be updating itself:
# then apt's lock is waited for, at most ten minutes.
for package in "${missing[@]}"; do
    "${as_root[@]}" apt-get -qq -o DPkg::Lock::Timeout=600 install -y --no-install-recommends "$package" > "$log" 2>&1 && continue
    case $package in
    clang | libclang-rt-14-dev | clang-format-14 | *cadical* | libglpk-dev | liblemon-dev | python3-open3d | gmsh | ruby | nix-bin) echo "tools/setup.sh: $package is not to be had; going on without it" >&2 ;;
    *) echo "tools/setup.sh: $package could not be installed:" >&2; tail -5 "$log" >&2; exit 1 ;;
    esac
done
