/*
 * QEMU plugin: counts the instructions executed between two addresses, both excluded, and among them accesses to memory
 * and jumps taken.
 *
 *     gcc -shared -fPIC -O2 counter.c -o counter.so
 *     qemu-... -plugin ./counter.so,begin=0x1234,end=0x5678,out=counts.txt ...
 *
 * `out` gets one line per passage, in order: instructions, accesses, jumps. QEMU's plugin interface (docs/devel/tcg-plugins) is
 * declared here by hand: no header is installed with the emulator. Interface version 1 (QEMU 4.2 to 8.1); for its
 * successors build with -DPLUGIN_VERSION=2 or later, the calls used are the same.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef PLUGIN_VERSION
#define PLUGIN_VERSION 1
#endif

#define EXPORT __attribute__((visibility("default")))

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef struct qemu_info_t qemu_info_t;
enum qemu_plugin_cb_flags { QEMU_PLUGIN_CB_NO_REGS };
enum qemu_plugin_mem_rw { QEMU_PLUGIN_MEM_R = 1, QEMU_PLUGIN_MEM_W, QEMU_PLUGIN_MEM_RW };

extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                                  void (*translated)(qemu_plugin_id_t, struct qemu_plugin_tb *));
extern void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *insn,
                                                   void (*executed)(unsigned int, void *),
                                                   enum qemu_plugin_cb_flags flags, void *data);
extern void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn *insn,
                                             void (*accessed)(unsigned int, uint32_t, uint64_t, void *),
                                             enum qemu_plugin_cb_flags flags, enum qemu_plugin_mem_rw which, void *data);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t id, void (*ended)(qemu_plugin_id_t, void *), void *data);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
extern struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t index);
extern uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);
extern size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *insn);

EXPORT int qemu_plugin_version = PLUGIN_VERSION;

/* Where an instruction lies; kept until the end, the emulator holds on to it. */
struct place {
    uint64_t address;
    uint64_t next;
};

static uint64_t begin_address, end_address;
static uint64_t instructions, accesses, jumps;
static const struct place *last;
static int counting;
static FILE *out;

static void on_begin(unsigned int cpu, void *data)
{
    (void)cpu;
    (void)data;
    counting = 1;
    instructions = accesses = jumps = 0;
    last = NULL;
}

static void on_end(unsigned int cpu, void *data)
{
    (void)cpu;
    (void)data;
    if (counting) {
        fprintf(out, "%llu %llu %llu\n", (unsigned long long)instructions, (unsigned long long)accesses,
                (unsigned long long)jumps);
        counting = 0;
    }
}

static void on_other(unsigned int cpu, void *data)
{
    const struct place *here = data;
    (void)cpu;
    ++instructions;
    jumps += last != NULL && last->next != here->address;
    last = here;
}

static void on_access(unsigned int cpu, uint32_t info, uint64_t address, void *data)
{
    (void)cpu;
    (void)info;
    (void)address;
    (void)data;
    ++accesses;
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    size_t n = qemu_plugin_tb_n_insns(tb);
    size_t i;
    (void)id;
    for (i = 0; i < n; ++i) {
        struct qemu_plugin_insn *insn = qemu_plugin_tb_get_insn(tb, i);
        uint64_t address = qemu_plugin_insn_vaddr(insn);
        void (*executed)(unsigned int, void *) = address == begin_address ? on_begin
                                                 : address == end_address ? on_end
                                                                          : on_other;
        struct place *place = malloc(sizeof *place);
        if (place == NULL) {
            abort();
        }
        place->address = address;
        place->next = address + qemu_plugin_insn_size(insn);
        qemu_plugin_register_vcpu_insn_exec_cb(insn, executed, QEMU_PLUGIN_CB_NO_REGS, place);
        qemu_plugin_register_vcpu_mem_cb(insn, on_access, QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_MEM_RW, NULL);
    }
}

static void on_exit_of_emulator(qemu_plugin_id_t id, void *data)
{
    (void)id;
    (void)data;
    fclose(out);
}

EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    int i;
    (void)info;
    for (i = 0; i < argc; ++i) {
        if (strncmp(argv[i], "begin=", 6) == 0) {
            begin_address = strtoull(argv[i] + 6, NULL, 0);
        } else if (strncmp(argv[i], "end=", 4) == 0) {
            end_address = strtoull(argv[i] + 4, NULL, 0);
        } else if (strncmp(argv[i], "out=", 4) == 0) {
            out = fopen(argv[i] + 4, "w");
        } else {
            fprintf(stderr, "counter: unknown argument %s\n", argv[i]);
            return -1;
        }
    }
    if (begin_address == 0 || end_address == 0 || out == NULL) {
        fprintf(stderr, "counter: begin=, end= and a writable out= are needed\n");
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
    qemu_plugin_register_atexit_cb(id, on_exit_of_emulator, NULL);
    return 0;
}
