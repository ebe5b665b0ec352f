/** Numbers in any form that remesh() takes. */
export type Numbers = number[] | Float32Array | Float64Array | Int32Array | Uint32Array | Int16Array | Uint16Array | Int8Array | Uint8Array;

/** The options of the library. At most one of faces, vertices, edge_length and ratio. */
export interface Options {
  /** number of quads wanted (0: not asked for) (faces); default: 0 */
  faces?: number;
  /** number of vertices wanted (0: not asked for) (vertices); default: 0 */
  vertices?: number;
  /** mean edge length wanted (0: not asked for) (input units); default: 0 */
  edge_length?: number;
  /** number of quads as a share of the input triangles (0: not asked for) (quads per input triangle); default: 0 */
  ratio?: number;
  /** drop components that have less than this share of the whole area, but never the largest (0: keep all) (share of the area); default: 0 */
  min_component?: number;
  /** turn closed components that are inside out outward, unless all are or it is a cavity in another; off keeps them as they are; default: true */
  outward?: boolean;
  /** an edge is sharp where its faces' normals differ by more than this; -1 finds a suitable angle, 180 finds none (degrees); default: -1 */
  sharp_angle?: number;
  /** only the edges that the input marks are sharp, whatever their angle: in OBJ lines and the borders of smoothing groups and materials; default: false */
  sharp_marks?: boolean;
  /** edges of the result follow the boundary of an open surface; default: true */
  align_boundary?: boolean;
  /** how much the size follows curvature: 0 not at all, 1 fully; default: 0 */
  adaptive?: number;
  /** how much the quads run along the directions in which the surface bends most and least: 0 gives the fewest irregular vertices, 1 follows the shape most; default: 0.5 */
  follow?: number;
  /** relief smaller than this (three quarters of it below 250 quads) does not steer the quads: less follows more of it, more gives fewer irregular vertices (edge lengths); default: 2 */
  smoothness?: number;
  /** how offsets become regular: from the position field by a solver of the paper's Table 4, or from the closest closed real offsets; default: closed */
  flow?: 'mf' | 'mf-mr' | 'mcf' | 'mcf-mr' | 'ilp' | 'closed';
  /** what a change of an offset costs the flow: 1, as in the paper, or more against the edge than along it; default: geometric */
  cost?: 'plain' | 'geometric';
  /** use the SAT solver where greedy shrinking leaves inverted triangles; default: true */
  sat?: boolean;
  /** relax the quads on the input surface at the end; default: true */
  relax?: boolean;
  /** what the relaxation weighs more: right angles at 0, even areas at 1; default: 0.5 */
  evenness?: number;
  /** mend and simplify the connectivity of the quads after extraction; default: true */
  repair?: boolean;
  /** seed of every random choice; default: 0 */
  seed?: number;
  /** threads to use (0: one a core); never changes the result (threads); default: 0 */
  threads?: number;
  /** the edges that the input marks are sharp too, beside those found by their angle; default: false */
  keep_marks?: boolean;
}

export interface Topology {
  /** vertices (vertices) */
  vertices: number;
  /** edges (edges) */
  edges: number;
  /** faces (faces) */
  faces: number;
  /** faces of four corners (faces) */
  quads: number;
  /** faces of three corners (faces) */
  triangles: number;
  /** faces of five corners and more (faces) */
  other_polygons: number;
  /** connected components (components) */
  components: number;
  /** boundary loops (loops) */
  boundary_loops: number;
  /** edges of one face (edges) */
  boundary_edges: number;
  /** Euler characteristic */
  euler: number;
  /** faces with a corner twice or without an area (faces) */
  degenerate_faces: number;
  /** faces on the corners of another (faces) */
  duplicate_faces: number;
  /** edges of more than two faces (edges) */
  nonmanifold_edges: number;
  /** vertices of several fans of faces (vertices) */
  nonmanifold_vertices: number;
  /** edges whose two faces are turned unlike (edges) */
  inconsistent_edges: number;
  /** vertices of no face (vertices) */
  isolated_vertices: number;
  /** interior vertices of valence other than 4 (vertices) */
  irregular: number;
  /** boundary vertices of valence other than 3 (vertices) */
  irregular_boundary: number;
  /** interior vertices by valence, "9" and more together; only those that there are */
  valence: Record<string, number>;
}

export interface Quality {
  /** root mean square of the difference of the corners from 90 degrees (degrees) */
  angle_rms: number | null;
  /** the difference that 99 % of the corners stay below (degrees) */
  angle_p99: number | null;
  /** standard deviation of the areas of the faces over their mean */
  area_cv: number | null;
  /** mean length of the edges (input units) */
  mean_edge: number | null;
  /** standard deviation of the lengths of the edges over their mean */
  edge_cv: number | null;
  /** least sine of a corner of a quad, negative where it is inverted */
  min_scaled_jacobian: number;
  /** corners of quads that are inverted (corners) */
  negative_corners: number | null;
  /** faces that are flipped against the surface or their neighbours (faces) */
  flipped_faces: number | null;
  /** mean distance from the mesh to the surface (mean edges) */
  out_to_in_mean: number | null;
  /** mean distance from the surface to the mesh (mean edges) */
  in_to_out_mean: number | null;
  /** mean of the two (mean edges) */
  chamfer: number | null;
  /** the distance that 99.9 % of the samples of both stay below (mean edges) */
  hausdorff_p999: number | null;
  /** the largest distance of a sample of either to the other (mean edges) */
  hausdorff: number | null;
  /** mean distance from sharp edges of the surface to edges of the mesh (mean edges) */
  sharp_mean: number | null;
  /** the distance that 95 % of those samples stay below (mean edges) */
  sharp_p95: number | null;
  /** mean angle between edges of quads and the principal directions of the surface, 0 to 45; 22.5 is chance (degrees) */
  follow: number | null;
  /** share of that weight within 10 degrees */
  follow10: number | null;
  /** share of that weight beyond 30 degrees */
  follow30: number | null;
  /** patches into which these lines and the boundaries cut the quads (patches) */
  patches: number | null;
  /** patches over the number of quads: 1 where every loop is cut */
  patch_share: number | null;
  /** strips of quads, side by side (chords) */
  chords: number | null;
  /** those that cross themselves (chords) */
  crossing: number | null;
  /** quads in the longest chord, over the square root of the number of quads */
  chord_max: number | null;
  /** mean distance from mirrored vertices to the nearest vertex, where the surface has a plane of symmetry; 0.38 is chance (mean edges) */
  mirror: number | null;
}

export interface Report {
  /** vertices of the input (vertices) */
  input_vertices: number;
  /** polygons of the input (faces) */
  input_faces: number;
  /** triangles that the input's polygons were cut into (triangles) */
  input_triangles: number;
  /** vertices that became one with another at the same place (vertices) */
  welded_vertices: number;
  /** triangles without an area that were dropped (triangles) */
  dropped_degenerate: number;
  /** triangles that were there twice and were dropped (triangles) */
  dropped_duplicate: number;
  /** vertices of no triangle that were dropped (vertices) */
  dropped_isolated: number;
  /** components that min_component dropped (components) */
  dropped_components: number;
  /** triangles that were turned over to agree with their neighbours (triangles) */
  flipped_triangles: number;
  /** closed components that were inside out and were turned outward (components) */
  turned_components: number;
  /** edges of more than two triangles that were cut apart (edges) */
  split_edges: number;
  /** vertices of several fans of triangles that were cut apart (vertices) */
  split_vertices: number;
  /** edges of seams across which the orientation of a one-sided surface turns over (edges) */
  one_sided_seam_edges: number;
  /** vertices that were moved to smooth folds in flat places (vertices) */
  unfolded_vertices: number;
  /** connected components of the cleaned surface (components) */
  components: number;
  /** boundary loops of the cleaned surface (loops) */
  boundary_loops: number;
  /** Euler characteristic of the cleaned surface */
  euler: number;
  /** edges of the cleaned surface that are sharp (edges) */
  feature_edges: number;
  /** tips of cones, spikes and the like, on no sharp edge (points) */
  feature_points: number;
  /** the angle above which an edge was sharp (degrees) */
  sharp_angle: number;
  /** quads that were asked for, whatever option said so (faces) */
  faces_asked: number;
  /** vertices of the working mesh (vertices) */
  working_vertices: number;
  /** triangles of the working mesh (triangles) */
  working_triangles: number;
  /** levels of the hierarchy (levels) */
  hierarchy_levels: number;
  /** singularities of the orientation field */
  orientation_singularities: number;
  /** triangles whose offsets do not close, before they are made regular */
  position_singularities_before: number;
  /** the same afterwards */
  position_singularities_after: number;
  /** nodes of the network (nodes) */
  network_nodes: number;
  /** arcs of the network (arcs) */
  network_arcs: number;
  /** components of the network (components) */
  network_components: number;
  /** offsets that constraints fix (variables) */
  fixed_variables: number;
  /** offsets that may change (variables) */
  free_variables: number;
  /** rounds in which capacities of the network were raised (rounds) */
  capacity_rounds: number;
  /** cost of the flow */
  flow_cost: number;
  /** edges that were split as their offsets were too long (edges) */
  subdivided_edges: number;
  /** triangles that the offsets inverted (triangles) */
  inverted_before: number;
  /** those left after greedy shrinking (triangles) */
  inverted_after_greedy: number;
  /** those left after the satisfiability solver (triangles) */
  inverted_after_sat: number;
  /** calls of the satisfiability solver (calls) */
  sat_calls: number;
  /** conflicts that it met (conflicts) */
  sat_conflicts: number;
  /** iterations of the least-squares solver for vertex positions (iterations) */
  least_squares_iterations: number;
  /** its residual at the end, relative to the first */
  least_squares_residual: number;
  /** doublets that were repaired */
  repaired_doublets: number;
  /** pairs of quads on the same corners that were repaired */
  repaired_pairs: number;
  /** places around which quads were made smaller (regions) */
  refined_regions: number;
  /** components made from their triangles, as the fields lost their topology (components) */
  fallback_components: number;
  /** parts that were left uncovered, until quads below them grew out, in the last attempt */
  grown_protrusions: number;
  /** quads that were flipped at the end, until other quads took their places (faces) */
  repaired_flips: number;
  /** attempts after the first */
  attempts: number;
  /** root mean square of the difference of the corners from 90 degrees (degrees) */
  angle_rms: number;
  /** standard deviation of the areas of the faces over their mean */
  area_cv: number;
  /** mean length of the edges (input units) */
  mean_edge: number;
  /** time that the stages took (seconds) */
  seconds: number;
  topology: Topology;
  warnings: string[];
  [more: string]: unknown;
}

export type Status = 'ARGUMENT' | 'OPTION' | 'FILE_MISSING' | 'FILE_UNREADABLE' | 'FILE_IS_DIRECTORY' | 'FILE_EMPTY' | 'FORMAT_UNKNOWN' | 'FORMAT_SYNTAX' | 'FORMAT_TRUNCATED' | 'INDEX_RANGE' | 'NOT_FINITE' | 'TOO_LARGE' | 'NO_FACES' | 'ONLY_DEGENERATE' | 'FILE_UNWRITABLE' | 'MEMORY' | 'CANCELLED' | 'NOT_READY' | 'UNSUPPORTED' | 'INTERNAL' | 'CRASHED';

/** A failure of the library, in a sentence that names its cause. */
export class QuadwrightError extends Error {
  readonly status: Status;
  /** that of the command line tool */
  readonly exitCode: number;
}

export interface Attribute {
  /** count * components numbers; whole ones where the kind is labels */
  values: Numbers;
  components?: number;
  domain?: 'vertex' | 'corner' | 'face';
  kind?: 'values' | 'normals' | 'uvs' | 'weights' | 'labels';
  /** of weights: the group of each */
  groups?: Numbers | null;
  /** of labels, where a file has them */
  names?: string[];
}

export interface CarriedAttribute extends Required<Pick<Attribute, 'components' | 'domain' | 'kind'>> {
  values: Float32Array | Int32Array;
  groups?: Uint32Array;
  names?: string[];
}

export interface Surface {
  positions: Float64Array;
  indices: Uint32Array;
  /** corners of every face where faceSizes is null */
  faceSize: number;
  faceSizes: Uint32Array | null;
}

export interface Result {
  /** three a vertex, in the units of the input */
  positions: Float64Array;
  /** four vertices a quad, counter-clockwise from outside */
  quads: Uint32Array;
  report: Report;
  /** those of the input, carried over */
  attributes: Record<string, CarriedAttribute>;
}

export interface SurfaceOptions {
  /** corners of every face: 3 (default) or 4 */
  faceSize?: 3 | 4;
  /** corners of each face, for polygons */
  faceSizes?: Numbers | null;
  /** pairs of vertices whose edge is sharp; turns sharp_marks on unless it is given */
  markedEdges?: Numbers | null;
  attributes?: Record<string, Attribute>;
}

export interface Hooks {
  signal?: AbortSignal;
  progress?: (stage: string, fraction: number) => void;
  /** warnings of the library */
  log?: (warning: string) => void;
}

export interface RemeshOptions extends Options, SurfaceOptions, Hooks {
  /** moves the arrays to the Worker instead of copying them: they are empty afterwards */
  transfer?: boolean;
  /** bytes; 0: none but that of the address space, 4 GiB */
  memoryLimit?: number;
}

export interface Tables {
  version: string;
  statuses: { status: string; text: string; exitCode: number }[];
  options: { name: string; kind: 'count' | 'real' | 'flag' | 'choice'; initial: number; least: number; most: number; unit: string; choices: string[] | null; help: string }[];
  fields: Record<'report' | 'topology' | 'quality', { name: string; unit: string; help: string; whole: boolean; optional: boolean }[]>;
}

/** Loads the module, once. wasm: where the package cannot find it by itself. */
export function init(options?: { wasm?: BufferSource | WebAssembly.Module | null }): Promise<Tables>;
export function tables(): Tables;

/** Remeshes in a Worker that ends with the call. indices null: every three positions are a triangle. */
export function remesh(positions: Numbers, indices: Numbers | null, options?: RemeshOptions): Promise<Result>;

/** The same on the calling thread. progress returns true to cancel. */
export function remeshSync(
  positions: Numbers,
  indices: Numbers | null,
  options?: Options & SurfaceOptions & { progress?: (stage: string, fraction: number) => boolean | void; log?: (warning: string) => void; memoryLimit?: number },
): Result;

/** A surface that is remeshed more than once, in a Worker that keeps what two runs have in common. */
export class Remesher {
  constructor(options?: { memoryLimit?: number });
  /** a file of OBJ, PLY, OFF or STL */
  load(file: ArrayBuffer | Uint8Array | Blob, hooks?: Pick<Hooks, 'signal' | 'log'>): Promise<Surface>;
  set(positions: Numbers, indices: Numbers | null, options?: SurfaceOptions & { transfer?: boolean; signal?: AbortSignal }): Promise<void>;
  remesh(options?: Options, hooks?: Hooks): Promise<Result>;
  mark(names: string): Promise<void>;
  save(format: 'obj' | 'ply' | 'off', options?: { bare?: boolean }): Promise<Uint8Array>;
  measure(options?: { input?: string | null; output?: string | null; signal?: AbortSignal }): Promise<{ report: Report; quality: Quality; [more: string]: unknown }>;
  close(): void;
}
