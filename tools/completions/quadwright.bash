# bash completion for quadwright; made by quadwright-manual: make docs
_quadwright() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} words=
  if [[ $current == = ]]; then current=
  elif [[ $previous == = ]]; then previous=${COMP_WORDS[COMP_CWORD-2]}; fi
  case $previous in
    help) words="size shape levels presets symmetry steering wrap asset files running measure render batch method stages status quadriflow examples all scan character cad game print soup " ;;
    --preset) words="scan character cad game print soup " ;;
    --format) words="obj ply off stl glb gltf msh vtu inp bdf " ;;
    --field-per) words="vertex face " ;;
    --bake) words="input all color,normal,orm,emission,occlusion,height " ;;
    --normals) words="input none smooth split " ;;
    --patches-from) words="quads blocks " ;;
    --color) words="follow own " ;;
    --sharp) words="auto none marks " ;;
    --flow) words="mf mf-mr mcf mcf-mr ilp closed " ;;
    --cost) words="plain geometric " ;;
    --symmetry) words="none auto x y z plane any " ;;
    --fit-to) words="quads limit " ;;
    --region-rim) words="keep free " ;;
    --fast) words="no draft preview " ;;
  esac
  if [[ -n $words ]]; then :
  elif [[ $current == -* ]]; then
    words="--input --output --out --jobs --shard --retry --force --format --json --provenance --keep --density --field-in --field-out --field-per --guides --region --unwrap --bake --no-attributes --normals --against --visible --limit --levels --second-order --patches --patches-from --coarse --width --height --views --color --lines --closed --chord --azimuth --elevation --dump-stage --from-stage --preset --sharp --memory-limit --time-limit --quiet --verbose --help --version --faces --vertices --edge-length --ratio --min-component --outward --no-outward --sharp-angle --sharp-marks --no-sharp-marks --align-boundary --no-align-boundary --adaptive --rings --follow-motion --follow --smoothness --flow --cost --sat --no-sat --relax --no-relax --evenness --repair --no-repair --seed --threads --keep-marks --no-keep-marks --symmetry --symmetry-follow --no-symmetry-follow --symmetry-x --symmetry-y --symmetry-z --symmetry-offset --loops --fix-boundary --no-fix-boundary --fit --fit-to --exact --no-exact --jacobian-min --subdivide --region-rim --fill-holes --wrap --no-wrap --wrap-distance --wrap-quads --fast --around --texture --margin --tiles --texel-density --texel-focus --stretch --unwrap-grid --samples --cage "
  elif [[ $COMP_CWORD -eq 1 ]]; then
    words="remesh asset measure render batch options version help "
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  if [[ $current != -* && ( -z $words || $COMP_CWORD -eq 1 ) ]]; then
    local file
    while IFS= read -r file; do COMPREPLY+=("$file"); done < <(compgen -f -- "$current")
  fi
}
complete -o filenames -F _quadwright quadwright
