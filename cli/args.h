/* The command line: `quadwright [COMMAND] ...`. Switches are one table (args.c); the library's options come from
 * options.def. QuadriFlow's own flags are understood, so that scripts that call `quadriflow` can call `quadwright`
 * instead. */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdio.h>

enum {
    QW_MOST_PANELS = 8,    /* meshes in one picture */
    QW_MOST_INPUTS = 256,  /* of one asset */
    QW_MOST_LEVELS = 16,   /* of detail */
    QW_UNSET_ANGLE = 10000 /* render: the angle was not given */
};

typedef enum qw_command {
    QW_COMMAND_REMESH,
    QW_COMMAND_ASSET, /* a remesh with maps */
    QW_COMMAND_MEASURE,
    QW_COMMAND_RENDER,
    QW_COMMAND_BATCH,
    QW_COMMAND_OPTIONS,
    QW_COMMAND_VERSION,
    QW_COMMAND_HELP
} qw_command;

/* Normals of the result: what the input has, none, or those of the quads. */
typedef enum qw_normals { QW_NORMALS_CARRIED, QW_NORMALS_NONE, QW_NORMALS_SMOOTH, QW_NORMALS_SPLIT } qw_normals;

extern const char *const qw_format_words[]; /* by qw_format */

/* Strings belong to argv. */
typedef struct qw_arguments {
    qw_command command;
    const char *input;      /* NULL only with from_stage, or for commands that take none */
    const char *output;     /* NULL: none; "-" standard output; batch: a folder */
    const char *against;    /* measure, render; may be NULL */
    const char *json;       /* remesh: file for the report, may be NULL; measure: not NULL when asked for */
    const char *provenance; /* remesh: file for where the result lies on the input; may be NULL */
    char keep[256];         /* remesh, batch: attributes whose borders are kept, as qw_mesh_mark has them; "" */
    const char *density;    /* remesh, batch: a vertex property, or a file of densities; may be NULL */
    const char *field_in, *field_out; /* remesh: cross fields; may be NULL */
    qw_domain field_per;              /* what the directions of field_out belong to */
    const char *guides;               /* remesh: may be NULL */
    const char *region;               /* remesh: may be NULL */
    bool unwrap;                      /* remesh: texture coordinates of its own */
    bool bake;                        /* remesh: maps on them */
    uint32_t maps;                    /* the same: bits of qw_map, or QW_MAPS_OF_INPUT */
    qw_asset_options asset;           /* the same */
    bool bare;                        /* remesh, batch: attributes stay behind */
    qw_normals normals;               /* remesh: what the result has */
    const char *from_stage;           /* may be NULL */
    const char *dump[QW_STAGE_COUNT]; /* file for the state after each stage, NULL: none */
    qw_format format;
    const char *inputs[QW_MOST_INPUTS];        /* render, asset: all of them, the input first */
    int64_t input_count, width, height, views; /* render; 0: not given */
    int64_t level[QW_MOST_LEVELS];             /* remesh: quads of each level of detail, of level_count */
    int64_t level_count;                       /* 0: one mesh, as the options say */
    bool second_order;                         /* remesh: elements with eight nodes */
    const char *patches;                       /* remesh: file for the limit surface as STEP; may be NULL */
    bool blocks;                               /* remesh: of large patches */
    bool limit;                                /* measure, render: the limit surface */
    const char *coarse;                        /* remesh: file for what was split; may be NULL */
    bool follow, own_colours, lines, closed;   /* render: what is drawn of the faces */
    int64_t chord;                             /* render: 1 is the longest; 0: not given */
    int64_t azimuth, elevation;                /* render: degrees, of the first view, or QW_UNSET_ANGLE */
    size_t memory_limit;                       /* remesh, batch: bytes; 0: none */
    const char *bare_memory_limit;             /* as it was given where it has no unit, else NULL */
    int64_t time_limit;                        /* remesh, batch: seconds; 0: none */
    int64_t jobs, shard, shards;               /* batch; jobs 0: one a processor; shards 0: all models */
    bool retry;                                /* batch: what failed before, too */
    bool force;   /* remesh: the result may replace the input; batch: results made with other options, too */
    bool visible; /* measure: against what is seen from outside */
    bool quiet, verbose, version;
    const char *preset; /* may be NULL */
    qw_options options;
} qw_arguments;

/* Writes a sentence into message and returns QW_ARGUMENT or QW_OPTION where argv is wrong. */
qw_status qw_parse_arguments(int argc, char **argv, qw_arguments *arguments, char *message, size_t message_size);

/* Whether the command takes the options of the library. */
static inline bool qw_takes_options(qw_command command)
{
    return command == QW_COMMAND_REMESH || command == QW_COMMAND_ASSET || command == QW_COMMAND_BATCH;
}
