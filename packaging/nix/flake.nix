# nix run 'github:quadwright/quadwright?dir=packaging/nix' -- scan.obj -o quads.obj
{
  description = "Any triangle surface in, a clean all-quad mesh out";

  inputs.nixpkgs.url = "github:NixOS/nixpkgs/nixpkgs-unstable";

  outputs = { self, nixpkgs }:
    let
      systems = [ "x86_64-linux" "aarch64-linux" "x86_64-darwin" "aarch64-darwin" ];
      forAll = nixpkgs.lib.genAttrs systems;
      package = pkgs: pkgs.stdenv.mkDerivation {
        pname = "quadwright";
        version = "0.1.0";
        src = pkgs.fetchurl {
          url = "https://github.com/quadwright/quadwright/releases/download/v0.1.0/quadwright-0.1.0-source.tar.gz";
          sha256 = "0000000000000000000000000000000000000000000000000000000000000000";
        };
        nativeBuildInputs = [ pkgs.cmake pkgs.ninja ];
        buildInputs = [ pkgs.libwebp ];
        cmakeFlags = [ "-DQW_BUILD_TESTS=OFF" ];
        meta = {
          description = "Any triangle surface in, a clean all-quad mesh out";
          homepage = "https://github.com/quadwright/quadwright";
          license = pkgs.lib.licenses.mit;
          mainProgram = "quadwright";
          platforms = pkgs.lib.platforms.unix;
        };
      };
    in {
      packages = forAll (system: { default = package nixpkgs.legacyPackages.${system}; });
      apps = forAll (system: {
        default = {
          type = "app";
          program = "${self.packages.${system}.default}/bin/quadwright";
        };
      });
      devShells = forAll (system: {
        default = nixpkgs.legacyPackages.${system}.mkShell { inputsFrom = [ self.packages.${system}.default ]; };
      });
    };
}
