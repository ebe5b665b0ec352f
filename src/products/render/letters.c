/* Each letter is a few strokes on a grid: x from 0 to 4 or less, y from 0 (lowest descender) over 2 (the line) and 6
 * (small letters) to 8 (capitals). A stroke is a run of digit pairs xy, joined by lines; one that begins with '~' is
 * the quadratic B-spline of its points instead, which passes through the ends and the middles between the others. A
 * stroke of one place is a dot.
 */
#include "products/render/letters.h"

#include <math.h>
#include <stddef.h>

enum { GRID_LINE = 2, GRID_CAPITAL = 8, FIRST = '!', LAST = '~', MOST_SEGMENTS = 96, STEPS = 6 };

static const char *const glyphs[LAST - FIRST + 1] = {
    "0804 0202",
    "0806 2826",
    "1218 3238 0646 0444",
    "~4748080545420203 2921",
    "0248 ~180806262818 ~342422424434", /* ! " # $ % */
    "4207 ~0708282615 ~15040212 ~123244",
    "0806",
    "~29070420",
    "~09272400",
    "1814 0537 0735", /* & ' ( ) * */
    "0444 2622",
    "~121100",
    "0434",
    "0202",
    "0139", /* + , - . / */
    "~280802424828",
    "072822",
    "~0708484602 0242",
    "~0708484525 ~2545420203",
    "32380444",
    "480805 ~050646420203",
    "~380804 ~040646420204",
    "084812",
    "~250508484525 ~250502424525",
    "~464404084846 ~464212",
    "0303 0606",
    "1616 ~121100",
    "370432",
    "0545 0343",
    "073402",
    "~0708484524 2424 2222",
    "~3536161333364808020242", /* : ; < = > ? @ */
    "022842 1535",
    "080222 0828 ~28484525 0525 ~25454222",
    "~474808024243",
    "080222 0828 ~28484222",
    "48080242 0535", /* A to E */
    "480802 0535",
    "~474808024245 4525",
    "0802 4842 0545",
    "0802",
    "3834 ~34320203",
    "0802 4804 1542",
    "080242", /* F to L */
    "0208254842",
    "02084248",
    "~280802424828",
    "0208 0828 ~28484525 0525",
    "~280802424828 2442", /* M to Q */
    "0208 0828 ~28484525 0525 2542",
    "~4748080545420203",
    "0848 2822",
    "0804 ~04024244 4448",
    "082248", /* R to V */
    "0812263248",
    "0842 0248",
    "082548 2522",
    "08480242", /* W to Z */
    "19090020",
    "0931",
    "09191000",
    "062846",
    "0141",
    "0817", /* [ \ ] ^ _ ` */
    "~260602424626 4642",
    "0802 ~260602424626",
    "~454606024243",
    "4842 ~260602424626",
    "0444 ~444606024243", /* a to e */
    "~381816 1612 0636",
    "~260602424626 4641 ~41400001",
    "0802 ~04064644 4442",
    "0602 0808",
    "1611 ~111000 1818", /* f to j */
    "0802 3603 1432",
    "0802",
    "0602 ~04062624 2422 ~24264644 4442",
    "0602 ~04064644 4442",
    "~260602424626", /* k to o */
    "0600 ~260602424626",
    "4640 ~260602424626",
    "0602 ~040636",
    "~3536060434320203",
    "1813 ~131232 0636", /* p to t */
    "0604 ~04024244 4642",
    "062246",
    "0612253246",
    "0642 0246",
    "0622 4610",
    "06460242", /* u to z */
    "~29190504 ~04051020",
    "0900",
    "~09192524 ~24251000",
    "~04163446", /* { | } ~ */
};

typedef struct segment {
    float x0, y0, x1, y1;
} segment;

typedef struct outline {
    segment segments[MOST_SEGMENTS];
    int count;
    float width; /* grid units */
} outline;

static void add_segment(outline *o, float x0, float y0, float x1, float y1)
{
    if (o->count < MOST_SEGMENTS) o->segments[o->count++] = (segment){x0, y0, x1, y1};
    o->width = fmaxf(o->width, fmaxf(x0, x1));
}

static float bend(float a, float b, float c, float t)
{
    return (1 - t) * ((1 - t) * a + t * b) + t * ((1 - t) * b + t * c);
}

/* Adds the segments of a stroke through the points, rounded if it is smooth. */
static void add_stroke(outline *o, const float (*p)[2], int count, int smooth)
{
    if (count == 1) add_segment(o, p[0][0], p[0][1], p[0][0], p[0][1]);
    for (int i = 1; !smooth && i < count; i++) add_segment(o, p[i - 1][0], p[i - 1][1], p[i][0], p[i][1]);
    for (int i = 1; smooth && i + 1 < count; i++) {
        float start[2], end[2];
        for (int k = 0; k < 2; k++) {
            start[k] = i == 1 ? p[0][k] : 0.5f * (p[i - 1][k] + p[i][k]);
            end[k] = i + 2 == count ? p[i + 1][k] : 0.5f * (p[i][k] + p[i + 1][k]);
        }
        for (int s = 0; s < STEPS; s++) {
            float t = (float)s / STEPS, u = (float)(s + 1) / STEPS;
            add_segment(o, bend(start[0], p[i][0], end[0], t), bend(start[1], p[i][1], end[1], t),
                        bend(start[0], p[i][0], end[0], u), bend(start[1], p[i][1], end[1], u));
        }
    }
}

/* The outline of a letter, by its glyph: strokes of pairs of digits, smooth behind "~". */
static void trace(char letter, outline *o)
{
    o->count = 0;
    o->width = 0;
    if (letter == ' ') {
        o->width = 1.5f;
        return;
    }
    const char *s = glyphs[(letter < FIRST || letter > LAST ? '?' : letter) - FIRST];
    while (*s) {
        float points[16][2];
        int count = 0, smooth = *s == '~';
        for (s += smooth; s[0] && s[0] != ' ' && s[1] && count < 16; s += 2, count++) {
            points[count][0] = (float)(s[0] - '0');
            points[count][1] = (float)(s[1] - '0');
        }
        add_stroke(o, (const float(*)[2])points, count, smooth);
        while (*s == ' ') s++;
    }
}

static float gap(float size) { return 1.9f * size / (GRID_CAPITAL - GRID_LINE); }

float letters_width(const char *text, float size)
{
    float width = 0;
    outline o;
    for (; *text; text++) {
        trace(*text, &o);
        width += o.width * size / (GRID_CAPITAL - GRID_LINE) + gap(size);
    }
    return width > 0 ? width - gap(size) : 0;
}

static float length_of(float x, float y) { return sqrtf(x * x + y * y); }

static float distance_to(const segment *s, float x, float y)
{
    float dx = s->x1 - s->x0, dy = s->y1 - s->y0, l = dx * dx + dy * dy, t = 0;
    if (l > 0) t = fminf(fmaxf(((x - s->x0) * dx + (y - s->y0) * dy) / l, 0), 1);
    return length_of(x - s->x0 - t * dx, y - s->y0 - t * dy);
}

static void blend(picture *p, int x, int y, const uint8_t colour[3], float share)
{
    if (x < 0 || y < 0 || x >= (int)p->width || y >= (int)p->height || share <= 0) return;
    uint8_t *c = p->rgb + 3 * ((size_t)y * p->width + (size_t)x);
    share = fminf(share, 1);
    for (int k = 0; k < 3; k++) c[k] = (uint8_t)((float)c[k] + share * ((float)colour[k] - (float)c[k]) + 0.5f);
}

/* Draws an outline with its left end and its line at these places, `size` pixels high. */
static void draw_outline(picture *p, const outline *o, float left, float line, float size, const uint8_t colour[3])
{
    float scale = size / (GRID_CAPITAL - GRID_LINE), half = fmaxf(0.068f * size, 0.55f);
    int x0 = (int)floorf(left - half - 1), x1 = (int)ceilf(left + o->width * scale + half + 1);
    int y0 = (int)floorf(line - 7.5f * scale - 1), y1 = (int)ceilf(line + 2 * scale + half + 1);
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            float gx = ((float)x + 0.5f - left) / scale, gy = GRID_LINE - ((float)y + 0.5f - line) / scale,
                  least = INFINITY;
            for (int i = 0; i < o->count; i++) least = fminf(least, distance_to(&o->segments[i], gx, gy));
            blend(p, x, y, colour, half - least * scale + 0.5f);
        }
}

void letters_draw(picture *p, float x, float y, float size, const uint8_t colour[3], const char *text)
{
    outline o;
    for (; *text; text++) {
        trace(*text, &o);
        if (o.count > 0) draw_outline(p, &o, x, y, size, colour);
        x += o.width * size / (GRID_CAPITAL - GRID_LINE) + gap(size);
    }
}

void letters_disc(picture *p, float x, float y, float radius, const uint8_t colour[3])
{
    for (int j = (int)floorf(y - radius - 1); j <= (int)ceilf(y + radius + 1); j++)
        for (int i = (int)floorf(x - radius - 1); i <= (int)ceilf(x + radius + 1); i++)
            blend(p, i, j, colour, radius - length_of((float)i + 0.5f - x, (float)j + 0.5f - y) + 0.5f);
}
