/* Text in pictures: a small stroke font of our own, drawn smoothly at any size. */
#pragma once

#include <stdint.h>

typedef struct picture {
    uint32_t width, height;
    uint8_t *rgb; /* uint8_t[height][width][3] */
} picture;

/* Width in pixels of printable ASCII (others count as '?') whose capitals are `size` pixels high. */
float letters_width(const char *text, float size);
/* x: left end; y: the line on which the letters stand. */
void letters_draw(picture *p, float x, float y, float size, const uint8_t colour[3], const char *text);
/* A filled disc, for legends. */
void letters_disc(picture *p, float x, float y, float radius, const uint8_t colour[3]);
