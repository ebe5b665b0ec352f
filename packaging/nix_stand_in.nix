# What nixpkgs gives a flake, as far as ours asks: nix-instantiate --eval --strict --json nix_stand_in.nix --argstr flake FILE
{ flake }:
let
  outputs = (import flake).outputs { inherit self nixpkgs; };
  self = outputs;
  pkgs = {
    stdenv.mkDerivation = facts: facts // { outPath = "/nix/store/" + facts.pname; };
    fetchurl = facts: facts;
    mkShell = facts: { outPath = "/nix/store/shell"; inputs = builtins.length facts.inputsFrom; };
    cmake = "cmake"; ninja = "ninja"; libwebp = "libwebp";
    lib = { licenses.mit = "MIT"; platforms.unix = [ "x86_64-linux" ]; };
  };
  nixpkgs = {
    lib.genAttrs = names: make: builtins.listToAttrs (map (name: { inherit name; value = make name; }) names);
    legacyPackages = { x86_64-linux = pkgs; aarch64-linux = pkgs; x86_64-darwin = pkgs; aarch64-darwin = pkgs; };
  };
  system = "x86_64-linux";
  facts = outputs.packages.${system}.default;
in {
  description = (import flake).description;
  inherit (facts) pname version src cmakeFlags meta;
  systems = builtins.attrNames outputs.packages;
  app = outputs.apps.${system}.default;
  shell = outputs.devShells.${system}.default.inputs;
}
