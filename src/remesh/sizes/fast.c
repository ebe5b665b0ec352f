#include "remesh/sizes/fast.h"

qw_options qw_without_slow(const qw_options *options)
{
    qw_options o = *options;
    if (o.fast >= QW_FAST_DRAFT) o.loops = 0;
    if (o.fast >= QW_FAST_PREVIEW) o.follow = o.adaptive = o.fit = 0;
    return o;
}
