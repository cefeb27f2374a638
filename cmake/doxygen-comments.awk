# Shows Doxygen the comments that our headers write in plain form. Lines stay where they are.
#   *.hpp: the comment at the head of a file, after the licence, describes the file.
#   *.h:   plain C. A comment before a declaration, or after one on its line, describes it.
FNR == 1 {
    c = FILENAME ~ /\.h$/
    head = 1
    if (c) sub(/SPDX-License-Identifier: .*/, "@file")
    else { print "/// @file"; next }
}
!c && head {
    if (/^\/\/ ?/) { sub(/^\/\//, "///"); print; next }
    head = 0
}
c && /^[ \t]*\/\* / && !/\/\* ----/ { sub(/\/\* /, "/** ") }
c && /^[ \t]*\/\*$/ { sub(/\/\*/, "/**") }
c && /[^ \t].*\/\* / && !/^[ \t]*\/\*/ { sub(/\/\* /, "/**< ") }
{ print }
