/* Any text as "name=value": a refusal with a sentence that changes nothing, or a value that validates and comes back.
 */
#include "quadwright/quadwright.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char name[256], message[64], back[128];
    if (size >= sizeof name) return 0;
    memcpy(name, data, size);
    name[size] = 0;
    char *value = strchr(name, '=');
    if (!value) return 0;
    *value++ = 0;
    qw_options options, before;
    memset(&options, 0, sizeof options);
    qw_options_init(&options);
    before = options;
    if (qw_option_set(&options, name, value, message, sizeof message) != QW_OK) {
        if (!message[0] || memcmp(&options, &before, sizeof options) != 0) abort();
        return 0;
    }
    if (qw_options_validate(&options, NULL, 0) != QW_OK) abort();
    if (qw_option_get(&options, name, back, sizeof back) != QW_OK) abort();
    before = options;
    if (qw_option_set(&options, name, back, NULL, 0) != QW_OK || memcmp(&options, &before, sizeof options) != 0)
        abort();
    return 0;
}
