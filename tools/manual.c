/* The manual in the forms that are committed and installed: quadwright-manual markdown|man|bash|zsh|fish. `make docs`
 * writes docs/cli.md, docs/man/quadwright.1 and tools/completions from it, and the test `documents` compares. */
#include "help.h"
#include "switches.h"

#include <string.h>

/* The options of a run, then those of texture coordinates and maps. */
static size_t option_count(void) { return qw_option_count() + qw_asset_option_count(); }
static const qw_option_info *option_at(size_t i)
{
    return i < qw_option_count() ? qw_option_at(i) : qw_asset_option_at(i - qw_option_count());
}

/* ---- words that more than one form needs */

static void put_dashed(const char *name)
{
    for (; *name; name++) putchar(*name == '_' ? '-' : *name);
}

/* Calls `put` for each of the words between bars of "a|b|c". */
static void each_choice(const char *list, void (*put)(const char *word, int length))
{
    for (;;) {
        int length = (int)strcspn(list, "|");
        put(list, length);
        if (!list[length]) return;
        list += length + 1;
    }
}

static bool has_choices(const char *value)
{
    return value && strchr(value, '|') && strcspn(value, ":/") == strlen(value);
}
static bool is_file(const char *value) { return value && strstr(value, "FILE"); }
static bool is_folder(const char *value) { return value && strstr(value, "FOLDER"); }

/* ---- man */

static void put_roff(const char *text)
{
    if (*text == '.' || *text == '\'') fputs("\\&", stdout);
    for (; *text; text++) {
        if (*text == '-') fputs("\\-", stdout);
        else if (*text == '\\') fputs("\\e", stdout);
        else putchar(*text);
    }
}

static void put_item(const char *head, const char *text)
{
    fputs(".TP\n.B ", stdout);
    put_roff(head);
    putchar('\n');
    put_roff(text);
    putchar('\n');
}

static void man_switches(bool standing_for)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++) {
        if ((row->id == SWITCH_STANDS_FOR) != standing_for) continue;
        char head[128];
        snprintf(head, sizeof head, "%s%s%s%s%s%s%s", row->alias ? "-" : "", row->alias ? row->alias : "",
                 row->alias && row->name ? ", " : "", row->name ? "--" : "", row->name ? row->name : "",
                 row->value ? " " : "", row->value ? row->value : "");
        put_item(head, row->help);
    }
}

static void man_options(void)
{
    for (size_t i = 0; i < option_count(); i++) {
        const qw_option_info *info = option_at(i);
        char head[256], initial[64] = "", text[512];
        qw_option_usage(info, head, sizeof head);
        qw_option_initial(info, initial, sizeof initial);
        bool unit = info->unit[0] && strcmp(info->unit, "-") != 0;
        snprintf(text, sizeof text, "%s (%s%sdefault %s)", info->help, unit ? info->unit : "", unit ? "; " : "",
                 initial);
        put_item(head, text);
    }
}

static void man_tables(void)
{
    const qw_preset_info *preset;
    puts(".SH PRESETS");
    for (size_t i = 0; (preset = qw_preset_at(i)); i++) {
        char text[512];
        snprintf(text, sizeof text, "%s (%s)", preset->help, preset->settings);
        put_item(preset->name, text);
    }
    puts(".SH STAGES");
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        char word[QW_STAGE_WORD];
        put_item(qw_stage_word((qw_stage)s, word), qw_stage_title((qw_stage)s));
    }
    puts(".SH EXIT STATUS");
    for (int s = 0; s < QW_STATUS_COUNT; s++) {
        char head[16];
        snprintf(head, sizeof head, "%d", qw_status_exit_code((qw_status)s));
        put_item(head, qw_status_text((qw_status)s));
    }
    put_item("1", "batch: some models failed; the report says which");
}

static void man(void)
{
    printf(".\\\" made by quadwright-manual: make docs\n.TH QUADWRIGHT 1 \"\" \"Quadwright %s\" \"User Commands\"\n",
           qw_version());
    puts(".SH NAME\nquadwright \\- any triangle surface in, a clean all\\-quad mesh out\n.SH SYNOPSIS\n.nf");
    for (size_t i = 0; qw_usage_at(i); i++) {
        put_roff(qw_usage_at(i)->line);
        putchar('\n');
    }
    puts(".fi\n.SH DESCRIPTION\nReads OBJ, PLY, OFF, STL, GLB and glTF, judged by their contents. Writes OBJ, PLY, "
         "OFF, STL, GLB and glTF, whole or not at all.\n"
         "Without a target the result has a quarter as many quads as the input has triangles, from 100 to 20000.");
    for (size_t i = 0; qw_usage_at(i); i++) put_item(qw_usage_at(i)->line, qw_usage_at(i)->about);
    puts(".SH SWITCHES");
    man_switches(false);
    puts(".SH OPTIONS");
    man_options();
    puts(".SH FLAGS OF QUADRIFLOW");
    man_switches(true);
    man_tables();
    puts(".SH EXAMPLES\n.nf");
    for (size_t i = 0; qw_example_at(i); i++) {
        put_roff(qw_example_at(i));
        putchar('\n');
    }
    puts(".fi");
}

/* ---- bash */

/* Words to be typed as they are; one in capitals stands for a value. */
static void put_word(const char *word, int length)
{
    if (word[0] >= 'a' && word[0] <= 'z') printf("%.*s ", length, word);
}

/* Whether a row before this one has the same name, as commands may each have their own. */
static bool is_repeated(size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (qw_switch_at(i)->name && strcmp(qw_switch_at(i)->name, qw_switch_at(index)->name) == 0) return true;
    return false;
}

static void bash_words(void)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        if (row->name && !is_repeated(i)) printf("--%s ", row->name);
    for (size_t i = 0; i < option_count(); i++) {
        for (int no = 0; no <= (option_at(i)->kind == QW_KIND_FLAG); no++) {
            printf(no ? "--no-" : "--");
            put_dashed(option_at(i)->name);
            putchar(' ');
        }
    }
}

static void put_presets(void)
{
    for (size_t i = 0; qw_preset_at(i); i++) printf("%s ", qw_preset_at(i)->name);
}

static void put_topics(void)
{
    for (size_t i = 0; qw_topic_at(i); i++) printf("%s ", qw_topic_at(i));
    put_presets();
}

static void bash_cases(void)
{
    const qw_switch_row *row;
    fputs("    --preset) words=\"", stdout), put_presets(), puts("\" ;;");
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        if (row->name && has_choices(row->value) && !is_file(row->value)) {
            printf("    --%s) words=\"", row->name);
            each_choice(row->value, put_word);
            puts("\" ;;");
        }
    for (size_t i = 0; i < option_count(); i++)
        if (option_at(i)->kind == QW_KIND_CHOICE) {
            fputs("    --", stdout);
            put_dashed(option_at(i)->name);
            fputs(") words=\"", stdout);
            each_choice(option_at(i)->choices, put_word);
            puts("\" ;;");
        }
}

static void bash(void)
{
    puts("# bash completion for quadwright; made by quadwright-manual: make docs\n"
         "_quadwright() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} words=\n"
         "  if [[ $current == = ]]; then current=\n" /* --preset=c is three words */
         "  elif [[ $previous == = ]]; then previous=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
         "  case $previous in");
    fputs("    help) words=\"", stdout), put_topics(), puts("\" ;;");
    bash_cases();
    puts("  esac\n"
         "  if [[ -n $words ]]; then :\n"
         "  elif [[ $current == -* ]]; then");
    fputs("    words=\"", stdout), bash_words(), puts("\"");
    puts("  elif [[ $COMP_CWORD -eq 1 ]]; then");
    fputs("    words=\"", stdout);
    for (int c = 0; c < QW_COMMAND_COUNT; c++) printf("%s ", qw_command_name((qw_command)c));
    puts("\"\n  fi\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  if [[ $current != -* && ( -z $words || $COMP_CWORD -eq 1 ) ]]; then\n"
         "    local file\n"
         "    while IFS= read -r file; do COMPREPLY+=(\"$file\"); done < <(compgen -f -- \"$current\")\n"
         "  fi\n"
         "}\n"
         "complete -o filenames -F _quadwright quadwright");
}

/* Where the first clause of a sentence ends; a bracket that it would cut through is left out. */
static const char *first_clause(const char *text)
{
    const char *end = text + strcspn(text, ";:"), *open = end;
    while (open > text && *open != '(' && *open != ')') open--;
    if (*open != '(') return end;
    while (open > text && open[-1] == ' ') open--;
    return open;
}

/* ---- zsh */

/* Help within a specification of _arguments: no brackets, colons and quotes. The first clause is enough. */
static void put_zsh_help(const char *text)
{
    for (const char *end = first_clause(text); text < end; text++) {
        if (*text == '\'') fputs("'\\''", stdout);
        else if (*text == '[' || *text == ']') putchar(*text == '[' ? '(' : ')');
        else putchar(*text);
    }
}

static void zsh_value(const char *value)
{
    if (!value) return;
    printf(":value:");
    if (is_folder(value)) printf("_files -/");
    else if (is_file(value)) printf("_files");
    else if (has_choices(value)) {
        putchar('(');
        each_choice(value, put_word);
        putchar(')');
    }
}

static void zsh_switches(void)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++) {
        if (!row->name || is_repeated(i)) continue;
        printf("    '*--%s[", row->name);
        put_zsh_help(row->help);
        putchar(']');
        if (strcmp(row->name, "preset") == 0) fputs(":preset:(", stdout), put_presets(), putchar(')');
        else zsh_value(row->value);
        puts("' \\");
    }
}

static void zsh_options(void)
{
    for (size_t i = 0; i < option_count(); i++) {
        const qw_option_info *info = option_at(i);
        for (int no = 0; no <= (info->kind == QW_KIND_FLAG); no++) {
            printf(no ? "    '--no-" : "    '--");
            put_dashed(info->name);
            putchar('[');
            put_zsh_help(info->help);
            putchar(']');
            if (info->kind != QW_KIND_FLAG) zsh_value(info->choices ? info->choices : "N");
            puts("' \\");
        }
    }
}

static void zsh(void)
{
    puts("#compdef quadwright\n# zsh completion for quadwright; made by quadwright-manual: make docs\n_quadwright() "
         "{\n  local -a topics commands");
    fputs("  topics=(", stdout), put_topics(), puts(")");
    fputs("  commands=(", stdout);
    for (int c = 0; c < QW_COMMAND_COUNT; c++) printf("%s ", qw_command_name((qw_command)c));
    puts(")\n  if [[ ${words[2]} == help ]] && (( CURRENT == 3 )); then compadd -a topics; return; fi\n"
         "  (( CURRENT == 2 )) && compadd -a commands\n"
         "  _arguments -s \\");
    zsh_switches();
    zsh_options();
    puts("    '*:file:_files'\n}\n_quadwright \"$@\"");
}

/* ---- fish */

static void put_fish_help(const char *text)
{
    fputs(" -d '", stdout);
    for (const char *end = first_clause(text); text < end; text++) {
        if (*text == '\'' || *text == '\\') putchar('\\');
        putchar(*text);
    }
    putchar('\'');
}

static void fish_values(const char *value)
{
    if (!value) return;
    fputs(" -r", stdout);
    if (!has_choices(value) || is_file(value)) return;
    fputs(" -f -a '", stdout);
    each_choice(value, put_word);
    putchar('\'');
}

static void fish_switches(void)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++) {
        if (!row->name || is_repeated(i)) continue;
        printf("complete -c quadwright -l %s", row->name);
        if (row->alias && !row->alias[1]) printf(" -s %s", row->alias);
        if (strcmp(row->name, "preset") == 0) fputs(" -r -f -a '", stdout), put_presets(), putchar('\'');
        else fish_values(row->value);
        put_fish_help(row->help);
        putchar('\n');
    }
}

static void fish(void)
{
    puts("# fish completion for quadwright; made by quadwright-manual: make docs");
    fputs("complete -c quadwright -n '__fish_is_nth_token 1' -a '", stdout);
    for (int c = 0; c < QW_COMMAND_COUNT; c++) printf("%s ", qw_command_name((qw_command)c));
    fputs("'\ncomplete -c quadwright -n '__fish_seen_subcommand_from help' -f -a '", stdout);
    put_topics();
    puts("'");
    fish_switches();
    for (size_t i = 0; i < option_count(); i++) {
        const qw_option_info *info = option_at(i);
        for (int no = 0; no <= (info->kind == QW_KIND_FLAG); no++) {
            printf("complete -c quadwright -l %s", no ? "no-" : "");
            put_dashed(info->name);
            if (info->kind != QW_KIND_FLAG) fish_values(info->choices ? info->choices : "N");
            put_fish_help(info->help);
            putchar('\n');
        }
    }
}

/* ---- markdown */

static void markdown(void)
{
    puts("# The command line\n\nPrinted by `quadwright help all`; `make docs` writes this page. `quadwright --help` is "
         "one screen, `quadwright help TOPIC` and\n"
         "`quadwright help OPTION` are parts.\n\n```");
    qw_print_manual(stdout);
    puts("```");
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        void (*print)(void);
    } forms[] = {{"markdown", markdown}, {"man", man}, {"bash", bash}, {"zsh", zsh}, {"fish", fish}};
    for (size_t i = 0; argc == 2 && i < sizeof forms / sizeof *forms; i++)
        if (strcmp(argv[1], forms[i].name) == 0) {
            forms[i].print();
            return ferror(stdout) || fflush(stdout) != 0;
        }
    fputs("usage: quadwright-manual markdown|man|bash|zsh|fish\n", stderr);
    return 2;
}
