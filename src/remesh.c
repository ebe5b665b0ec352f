/* The whole of Quadwright in order: the stages are in stages.def, what each does in the folder stages, why some
 * are run again in run/retries.def.
 */
#include "remesh.h"

const qw_stage_function qw_stage_functions[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) qw_stage_##name,
#include "quadwright/stages.def"
#undef QW_STAGE
};
