/* What a run did and what a mesh is like, as JSON with one name a member of quadwright.h. */
#pragma once

#include "base/json.h"
#include "quadwright/quadwright.h"

/* Sets to 0 what the stage and those after it have reported. */
void qw_report_forget(qw_report *report, qw_stage first);

/* name: of the object within the one around it; NULL for the outermost. */
void qw_json_report(qw_json *json, const char *name, const qw_report *report);
void qw_json_options(qw_json *json, const char *name, const qw_options *options);
void qw_json_asset(qw_json *json, const char *name, const qw_asset_report *report);
void qw_json_transfer(qw_json *json, const qw_transfer_report *report); /* as "attributes" */
void qw_json_quality(qw_json *json, const char *name, const qw_quality *quality);
/* All figures of one mesh in one object. Those that do not apply are null. */
void qw_json_measures(qw_json *json, const qw_topology *topology, const qw_quality *quality);
void qw_json_run(qw_json *json, const qw_run_info *run);
