# Part for <model>_usr.mk of dSPACE RTI. RTI compiles sf_adc_mapping.c itself: it must not stand here.
# SFCN_DIR is the folder of these files, relative to the model's; no blanks in it.
SFCN_DIR = .

USER_SRCS = \
    adc_mapping.c \
    adc_mapping_block.c

USER_SRCS_DIR = $(SFCN_DIR)
USER_INCLUDES_PATH = $(SFCN_DIR)
USER_OBJS =
USER_LIBS =
